// The checks of rights, CPU, clock and network.
#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <string>

#include "daemon/system/realtime.hpp"
#include "daemon/tools/doctor/doctor.hpp"
#include "daemon/tools/doctor/wanted.hpp"
#include "drivers/transport/udp.hpp"
#include "proto/text/clean.hpp"

namespace posed::doctor {
namespace {

namespace fs = std::filesystem;

// mlockall counts addresses, also those of thread stacks that nobody has touched: a daemon with
// room for 64 streams has 0.6 GB of them. Beyond the limit it could not even start a thread.
constexpr std::uint64_t kLeastLocked_bytes = std::uint64_t{2} << 30;

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
  if (machine.locked_limit_bytes >= kLeastLocked_bytes) return right(name, found);
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
  if (source.empty()) return right(name, "this system does not tell");
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
      return right(name, "this system does not tell");
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
  if (most.empty()) return right(name, "this system does not tell");
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
