// The checks of devices: whether they may be opened, and whether their bytes come at once.
#include <algorithm>
#include <charconv>
#include <string>

#include "daemon/tools/doctor/doctor.hpp"
#include "daemon/tools/doctor/wanted.hpp"
#include "proto/text/clean.hpp"

namespace posed::doctor {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNoGloves = "not needed: no glove or adapter is here, none in the config";
constexpr const char* kInstallRules =
    "sudo cp config/udev/70-posed.rules /etc/udev/rules.d/ && sudo udevadm control --reload &&"
    " sudo udevadm trigger";
constexpr const char* kGroups[] = {"dialout", "plugdev"};  // those of the udev rules
constexpr int kLongestLatency_ms = 1;

bool gloves_matter(const Machine& machine, Config config) {
  return !machine.nodes.empty() || (config != nullptr && wants_gloves(*config));
}

// Where the rules are; empty if they are not installed.
std::string rules_file(const Machine& machine) {
  for (const char* folder : {"etc/udev/rules.d", "usr/lib/udev/rules.d", "lib/udev/rules.d",
                             "usr/local/lib/udev/rules.d", "run/udev/rules.d"}) {
    const fs::path file = fs::path(folder) / "70-posed.rules";
    std::error_code failed;
    if (fs::is_regular_file(machine.root / file, failed)) return "/" + file.string();
  }
  return {};
}

int number_of(const std::string& text) {
  int number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

// The ids of processes with this name.
std::vector<fs::path> processes_named(const Machine& machine, const std::string& name) {
  std::vector<fs::path> found;
  for (const fs::path& process : entries_of(machine, "proc")) {
    if (process.filename().string().find_first_not_of("0123456789") != std::string::npos) continue;
    if (line_of(machine, process / "comm") == name) found.push_back(process);
  }
  return found;
}

// The serial port that the process has open; empty if there is none, or none that may be seen.
std::string held_port(const Machine& machine, const fs::path& process) {
  for (const fs::path& fd : entries_of(machine, process / "fd")) {
    std::error_code unreadable;
    const std::string target = fs::read_symlink(fd, unreadable).string();
    if (target.starts_with("/dev/ttyUSB") || target.starts_with("/dev/ttyACM")) return target;
  }
  return {};
}

}  // namespace

Check check_groups(const Machine& machine, Config config) {
  const std::string name = "device access";
  if (!gloves_matter(machine, config)) return right(name, kNoGloves);
  std::string groups, closed;
  for (const Node& node : machine.nodes) {
    if (node.info.open_error.empty()) continue;
    add_word(closed, node.info.node);
    const bool joins = !node.group.empty() && !machine.groups.contains(node.group);
    if (joins && !groups.contains(node.group)) groups += (groups.empty() ? "" : ",") + node.group;
  }
  const std::string join = "sudo usermod -aG " + (groups.empty() ? "dialout,plugdev" : groups) +
                           " " + machine.user + "  # then log in again";
  if (!closed.empty()) {
    return wrong(name, closed + " cannot be opened by " + machine.user,
                 groups.empty() ? kInstallRules : join);
  }
  if (!machine.nodes.empty()) {
    return right(name, std::to_string(machine.nodes.size()) + " devices may be opened");
  }
  const bool member = std::ranges::all_of(
      kGroups, [&](const char* group) { return machine.groups.contains(group); });
  if (member) return right(name, machine.user + " is in dialout and plugdev");
  if (machine.user == "root") return right(name, "root opens every device");
  if (!rules_file(machine).empty()) {
    return right(name, "the udev rules let in the user at this machine's screen");
  }
  return wrong(name, machine.user + " is not in the groups dialout and plugdev", join);
}

Check check_udev_rules(const Machine& machine, Config config) {
  const std::string name = "udev rules";
  if (const std::string file = rules_file(machine); !file.empty()) return right(name, file);
  if (!gloves_matter(machine, config)) return right(name, kNoGloves);
  return wrong(name, "70-posed.rules is not installed", kInstallRules);
}

Check check_usb_latency(const Machine& machine) {
  const std::string name = "usb latency";
  std::string slow, ports;
  for (const fs::path& port : entries_of(machine, "sys/bus/usb-serial/devices")) {
    const std::string latency = line_of(machine, port / "latency_timer");
    if (latency.empty()) continue;  // only FTDI's adapters collect bytes
    const std::string node = port.filename().string();
    add_word(ports, node);
    if (number_of(latency) <= kLongestLatency_ms) continue;
    add_word(slow, node);
    slow += " " + latency + " ms";
  }
  if (ports.empty()) return right(name, "no USB adapter with a latency timer is here");
  if (slow.empty()) return right(name, ports + " deliver at once (1 ms)");
  return wrong(name, "the adapter collects bytes for " + slow,
               "echo 1 | sudo tee /sys/bus/usb-serial/devices/*/latency_timer  # the udev rules do"
               " it for good");
}

Check check_modem_manager(const Machine& machine, Config config) {
  const std::string name = "modem manager";
  const auto processes = processes_named(machine, "ModemManager");
  if (processes.empty()) return right(name, "ModemManager does not run");
  const std::string stop = "sudo systemctl disable --now ModemManager";
  for (const fs::path& process : processes) {
    const std::string port = held_port(machine, process);
    if (!port.empty()) return wrong(name, "ModemManager holds " + clean_name(port), stop);
  }
  if (!gloves_matter(machine, config)) return right(name, kNoGloves);
  if (!rules_file(machine).empty()) {
    return right(name, "ModemManager runs, and the udev rules keep it from gloves");
  }
  return wrong(name, "ModemManager sends modem commands to each adapter that is plugged in", stop);
}

}  // namespace posed::doctor
