#include "daemon/tools/doctor/doctor.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <span>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/take_tables.hpp"
#include "daemon/system/realtime.hpp"
#include "drivers/transport/udp.hpp"
#include "proto/log/reader.hpp"
#include "proto/model/model_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::doctor {
namespace {

constexpr double kAssumedRate_hz = 120.0;  // where only the device knows
constexpr std::size_t kAssumedBodies = 4;  // of a source whose bodies the config does not name
// Measured on a walk from a BVH at 120 Hz: a row with a line of the clip (packets are shorter), and
// a row with the published frame.
constexpr double kChunk_bytes = 900.0;
constexpr double kFrame_bytes = 1100.0;

const drivers::Driver* driver_of(const std::string& name) { return drivers::find_driver(name); }

// Whether it is a glove on a port of this machine; an emulated one has its port elsewhere.
bool is_glove(const config::StreamConfig& stream) {
  const drivers::Driver* driver = driver_of(stream.driver);
  const std::string port = config::text_option(stream.options, "port");
  return driver != nullptr && driver->glove != nullptr &&
         config::text_option(stream.options, "link") != "tcp" &&
         (port.empty() || port.starts_with("/dev/"));
}

double bytes_per_s(double rate_hz, std::size_t bodies, bool frames) {
  const double rate = rate_hz > 0.0 ? rate_hz : kAssumedRate_hz;
  return rate * static_cast<double>(bodies) * (kChunk_bytes + (frames ? kFrame_bytes : 0.0));
}

}  // namespace

bool wants_gloves(const config::DaemonConfig& config) {
  return std::ranges::any_of(config.streams, is_glove);
}

double recorded_bytes_per_s(const config::DaemonConfig& config) {
  const bool frames = config.record && config.record->frames;
  double sum = 0.0;
  for (const config::StreamConfig& stream : config.streams) {
    const drivers::Driver* driver = driver_of(stream.driver);
    const bool known = driver != nullptr && driver->expect != nullptr;
    const auto expected = known ? driver->expect(stream.options) : fail("only the device knows");
    sum += bytes_per_s(expected ? expected->rate_hz : 0.0, 1, frames);
  }
  for (const config::SourceConfig& source : config.sources) {
    const std::size_t bodies =
        source.all ? std::max(kAssumedBodies, source.named.size()) : source.named.size();
    sum += bytes_per_s(source.rate_hz, bodies, frames);
  }
  return sum;
}

std::vector<Check> examine(const Machine& machine, Config config) {
  return {check_groups(machine, config),
          check_udev_rules(machine, config),
          check_usb_latency(machine),
          check_modem_manager(machine, config),
          check_priority(machine, config),
          check_memory_lock(machine, config),
          check_governor(machine),
          check_clock_source(machine),
          check_clock_sync(machine),
          check_socket_buffers(machine, config),
          check_disk(machine, config),
          check_ports(machine, config),
          check_keys(config),
          check_models(config),
          check_logs(config)};
}

namespace {

namespace fs = std::filesystem;

constexpr const char* kNoGloves = "not needed: no glove or adapter is here, none in the config";
constexpr const char* kInstallRules =
    "sudo cp config/udev/70-posed.rules /etc/udev/rules.d/ && sudo udevadm control --reload &&"
    " sudo udevadm trigger";
constexpr const char* kGroups[] = {"dialout", "plugdev"};  // those of the udev rules
constexpr int kMaxLatency_ms = 1;

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
    if (joins && !groups.contains(node.group)) add_word(groups, node.group, ",");
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
    if (number_of(latency) <= kMaxLatency_ms) continue;
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

namespace {

namespace fs = std::filesystem;

constexpr double kMinRecording_h = 1.0;

// The folder itself, or the first one above it that exists.
fs::path existing(fs::path folder) {
  std::error_code failed;
  folder = fs::absolute(folder, failed);
  while (!fs::is_directory(folder, failed) && folder.has_relative_path()) {
    folder = folder.parent_path();
  }
  return folder;
}

std::string shown(const fs::path& path) { return clean(path.string()); }

// The secret keys that a config names.
std::vector<fs::path> key_files(const config::DaemonConfig& config) {
  std::vector<fs::path> files;
  if (!config.security.server_key.empty()) files.push_back(config.security.server_key);
  const auto add = [&](const drivers::Options& options) {
    if (const std::string key = config::text_option(options, "key"); !key.empty())
      files.emplace_back(key);
  };
  for (const config::StreamConfig& stream : config.streams) add(stream.options);
  for (const config::SourceConfig& source : config.sources) add(source.options);
  return files;
}

void add_models(const config::StreamConfig& stream, std::vector<fs::path>& files) {
  for (const config::StageConfig& stage : stream.stages) {
    if (!stage.model.empty()) files.push_back(stage.model);
  }
}

std::vector<fs::path> model_files(const config::DaemonConfig& config) {
  std::vector<fs::path> files;
  for (const config::StreamConfig& stream : config.streams) add_models(stream, files);
  for (const config::SourceConfig& source : config.sources) {
    for (const auto& named : source.named) add_models(named.stream, files);
    add_models(source.every, files);
  }
  std::ranges::sort(files);
  files.erase(std::ranges::unique(files).begin(), files.end());
  return files;
}

Result<> try_model(const fs::path& path) {
  const auto bytes = TRY(model_file::load(path));
  TRY(model_file::open(std::as_bytes(std::span(bytes)), path.string()));
  return {};
}

}  // namespace

Check check_disk(const Machine& machine, Config config) {
  const std::string name = "disk";
  if (config == nullptr) return needs_config(name);
  if (!config->record) return right(name, "not needed: the config has no [record]");
  const fs::path folder = existing(config->record->folder);
  if (!machine.may_write(folder)) {
    return wrong(name, "no permission to write to " + shown(folder),
                 "sudo chown " + machine.user + " " + shown(folder));
  }
  if (const auto fine = config::check_folder(*config->record); !fine) {
    return wrong(name, fine.error().text(), "set [record] folder to one where files can be made");
  }
  const auto free = machine.free_bytes(folder);
  if (!free) return right(name, "the free space of " + shown(folder) + " is unknown");
  const double rate = recorded_bytes_per_s(*config);
  const double hours = rate > 0.0 ? static_cast<double>(*free) / rate / 3600.0 : 1e9;
  const std::string found =
      fmt::format("{:.1f} GB free in {}, for about {:.1f} hours at {:.0f} KB a second",
                  static_cast<double>(*free) / 1e9, shown(folder), hours, rate / 1e3);
  if (hours >= kMinRecording_h) return right(name, found);
  return wrong(name, found, "free some space, or set [record] folder to a larger disk");
}

Check check_ports(const Machine& machine, Config config) {
  const std::string name = "ports";
  if (config == nullptr) return needs_config(name);
  std::string bad;
  const auto listeners = listeners_of(*config);
  for (const Listener& listener : listeners) {
    const auto bound = machine.try_bind(listener);
    if (bound) continue;
    bad += (bad.empty() ? "" : "; ") + listener.who + ": " + (listener.udp ? "udp " : "tcp ") +
           clean_name(listener.endpoint) + " cannot be bound (" + bound.error().message + ")";
  }
  if (bad.empty()) return right(name, std::to_string(listeners.size()) + " can be bound");
  return wrong(name, bad,
               "see who has it with `sudo ss -tulpn`: perhaps posed runs already (`posed ctl"
               " status`); end that, or choose another port in the config");
}

Check check_keys(Config config) {
  const std::string name = "keys";
  if (config == nullptr) return needs_config(name);
  const auto files = key_files(*config);
  if (files.empty()) return right(name, "not needed: the config names no secret key");
  for (const fs::path& file : files) {
    struct stat info{};
    if (::stat(file.c_str(), &info) == 0 && (info.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
      return wrong(name, shown(file) + " can be read by other users", "chmod 600 " + shown(file));
    }
    if (const auto pair = net::read_secret_key(file); !pair) {
      return wrong(name, pair.error().text(),
                   "posed keygen " + shown(file.stem()) + " --out " +
                       shown(file.has_parent_path() ? file.parent_path() : "."));
    }
  }
  return right(name, std::to_string(files.size()) + " that only their owner reads");
}

Check check_models(Config config) {
  const std::string name = "models";
  if (config == nullptr) return needs_config(name);
  const auto files = model_files(*config);
  if (files.empty()) return right(name, "not needed: the config names no model");
  for (const fs::path& file : files) {
    if (const auto opened = try_model(file); !opened) {
      return wrong(name, opened.error().text(),
                   "give the right path, or train it with this version (`posed train --help`)");
    }
  }
  return right(name, std::to_string(files.size()) + " that this version reads");
}

Check check_logs(Config config) {
  const std::string name = "logs";
  if (config == nullptr) return needs_config(name);
  if (!config->record) return right(name, "not needed: the config has no [record]");
  int count = 0;
  std::error_code failed;
  for (fs::directory_iterator entry(config->record->folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    if (entry->path().extension() != ".plog") continue;
    if (const auto readable = log::check_format(entry->path()); !readable) {
      return wrong(name, readable.error().text(),
                   "move it out of " + shown(config->record->folder) + ", or update posed");
    }
    ++count;
  }
  return right(name, count == 0 ? "none in " + shown(config->record->folder) + " yet"
                                : std::to_string(count) + " that this version reads");
}

namespace {

namespace fs = std::filesystem;

// mlockall counts addresses, also those of thread stacks that nobody has touched: a daemon with
// room for 64 streams has 0.6 GB of them. Beyond the limit it could not even start a thread.
constexpr std::uint64_t kMinLocked_bytes = std::uint64_t{2} << 30;

// The line that gives this user a right at the next login; a service has it in its unit.
std::string limit_line(const Machine& machine, const char* what) {
  return "echo '" + machine.user + " - " + what +
         "' | sudo tee -a /etc/security/limits.d/70-posed.conf  # then log in again";
}

bool without_realtime(Config config) { return config != nullptr && !config->realtime; }

// A governor that lets the clock of a core rise within a frame.
bool is_quick(const std::string& governor, const std::string& driver) {
  if (governor == "performance" || governor == "schedutil" || governor == "ondemand") return true;
  // Here the processor chooses its clock by itself.
  return governor == "powersave" &&
         (driver.starts_with("intel_pstate") || driver.starts_with("amd-pstate"));
}

bool is_quick_clock(const std::string& source) {
  constexpr std::array kWithoutSystemCall{"tsc", "kvm-clock", "arch_sys_counter",
                                          "hyperv_clocksource_tsc_page", "xen"};
  return std::ranges::find(kWithoutSystemCall, source) != kWithoutSystemCall.end();
}

bool has_datagrams(const config::DaemonConfig& config) {
  const auto listeners = listeners_of(config);
  return std::ranges::any_of(listeners,
                             [](const Listener& one) { return one.udp && one.who != "trigger"; });
}

}  // namespace

Check check_priority(const Machine& machine, Config config) {
  const std::string name = "real-time priority";
  if (without_realtime(config)) return right(name, "not needed: the config has realtime = false");
  if (machine.may_schedule) return right(name, "this user may use any priority");
  const std::string limit = std::to_string(machine.priority_limit);
  if (machine.priority_limit >= system::kReaderPriority) {
    return right(name,
                 "up to " + limit + ", " + std::to_string(system::kReaderPriority) + " is needed");
  }
  return wrong(name,
               "up to " + limit + " (RLIMIT_RTPRIO): frames are late when the machine is busy",
               limit_line(machine, "rtprio 20"));
}

Check check_memory_lock(const Machine& machine, Config config) {
  const std::string name = "memory lock";
  if (without_realtime(config)) return right(name, "not needed: the config has realtime = false");
  if (machine.may_lock) return right(name, "this user may lock all memory");
  if (machine.locked_limit_bytes == kNoLimit) return right(name, "without limit");
  const std::string found =
      std::to_string(machine.locked_limit_bytes / 1024) + " KB may be locked (RLIMIT_MEMLOCK)";
  if (machine.locked_limit_bytes >= kMinLocked_bytes) return right(name, found);
  return wrong(name, found + ": a page that was swapped out delays a frame",
               limit_line(machine, "memlock unlimited"));
}

Check check_governor(const Machine& machine) {
  const std::string name = "cpu governor";
  std::map<std::string, bool> governors;  // name -> quick
  for (const fs::path& cpu : entries_of(machine, "sys/devices/system/cpu")) {
    const std::string governor = line_of(machine, cpu / "cpufreq/scaling_governor");
    if (governor.empty()) continue;
    governors[governor] = is_quick(governor, line_of(machine, cpu / "cpufreq/scaling_driver"));
  }
  if (governors.empty()) return right(name, "the clock of this machine's CPUs is not governed");
  std::string all;
  bool quick = true;
  for (const auto& [governor, good] : governors) {
    add_word(all, clean_name(governor));
    quick = quick && good;
  }
  if (quick) return right(name, all);
  return wrong(name, all + ": CPUs that wake up slowly delay frames",
               "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor");
}

Check check_clock_source(const Machine& machine) {
  const std::string name = "clock source";
  const fs::path folder = "sys/devices/system/clocksource/clocksource0";
  const std::string source = line_of(machine, folder / "current_clocksource");
  if (source.empty()) return right(name, "this system does not say");
  if (is_quick_clock(source)) return right(name, clean_name(source));
  const std::string available = " " + line_of(machine, folder / "available_clocksource") + " ";
  const bool has_tsc = available.contains(" tsc ");
  return wrong(name, clean_name(source) + ": each look at the clock is a slow system call",
               has_tsc ? "echo tsc | sudo tee /" + (folder / "current_clocksource").string()
                       : "see what `sudo dmesg | grep -i tsc` says; a firmware update often helps");
}

Check check_clock_sync(const Machine& machine) {
  const std::string name = "clock synchronisation";
  switch (machine.clock) {
    case ClockState::kSynchronised:
      return right(name, "this machine follows a time server");
    case ClockState::kUnknown:
      return right(name, "this system does not say");
    case ClockState::kFree:
      break;
  }
  return wrong(name, "the clock follows no time server: takes of several machines do not align",
               "sudo timedatectl set-ntp true  # Debian: after sudo apt install systemd-timesyncd");
}

Check check_socket_buffers(const Machine& machine, Config config) {
  const std::string name = "socket buffers";
  if (config == nullptr) return needs_config(name);
  if (!has_datagrams(*config)) return right(name, "not needed: no source of the config uses UDP");
  const std::string most = line_of(machine, "proc/sys/net/core/rmem_max");
  if (most.empty()) return right(name, "this system does not say");
  std::uint64_t bytes = 0;
  std::from_chars(most.data(), most.data() + most.size(), bytes);
  const std::string wanted = std::to_string(drivers::kUdpBuffer_bytes);
  const std::string found = "net.core.rmem_max is " + clean_name(most) + " bytes";
  if (bytes >= drivers::kUdpBuffer_bytes) return right(name, found);
  return wrong(name, found + ", UDP sources ask for " + wanted,
               "echo net.core.rmem_max=" + wanted +
                   " | sudo tee /etc/sysctl.d/70-posed.conf && sudo sysctl --system");
}

}  // namespace posed::doctor
