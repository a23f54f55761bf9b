// `posed doctor`: looks at this computer, and at what a config wants of it. Each check is a pure
// function of its arguments, except that it reads files. Cold.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/doctor/machine.hpp"

namespace posed::doctor {

// One finding of `posed doctor`.
struct Check {
  std::string name;   // "usb latency"; the same in every run, for scripts
  bool ok = true;     // also when it does not apply to this machine or config
  std::string found;  // what is there, or why it does not apply
  // The line that mends it; empty if ok. A command can be pasted into a shell: words about it come
  // behind a #.
  std::string fix{};
  bool looked = true;  // false: it needs a config, and there is none; then it counts as ok
};

[[nodiscard]] inline Check right(std::string name, std::string found) {
  return {.name = std::move(name), .ok = true, .found = std::move(found)};
}
[[nodiscard]] inline Check wrong(std::string name, std::string found, std::string fix) {
  return {.name = std::move(name), .ok = false, .found = std::move(found), .fix = std::move(fix)};
}
[[nodiscard]] inline Check needs_config(std::string name) {
  return {.name = std::move(name), .found = "not looked at: give --config FILE", .looked = false};
}

// Whether it has a glove on a serial, HID or USB port.
[[nodiscard]] bool wants_gloves(const config::DaemonConfig& config);

// About how much of the disk recording needs. Bodies that come later count as four a source.
[[nodiscard]] double recorded_bytes_per_s(const config::DaemonConfig& config);

// `config` is null where the user gave none; a check that needs one says so.
using Config = const config::DaemonConfig*;

// All of them, in the order in which people read them.
[[nodiscard]] std::vector<Check> examine(const Machine& machine, Config config);

// Devices: may they be opened, and do their bytes come at once?
[[nodiscard]] Check check_groups(const Machine& machine, Config config);
[[nodiscard]] Check check_udev_rules(const Machine& machine, Config config);
[[nodiscard]] Check check_usb_latency(const Machine& machine);
[[nodiscard]] Check check_modem_manager(const Machine& machine, Config config);

// Rights of this process.
[[nodiscard]] Check check_priority(const Machine& machine, Config config);
[[nodiscard]] Check check_memory_lock(const Machine& machine, Config config);

// The system.
[[nodiscard]] Check check_governor(const Machine& machine);
[[nodiscard]] Check check_clock_source(const Machine& machine);
[[nodiscard]] Check check_clock_sync(const Machine& machine);
[[nodiscard]] Check check_socket_buffers(const Machine& machine, Config config);

// What the config names.
[[nodiscard]] Check check_disk(const Machine& machine, Config config);
[[nodiscard]] Check check_ports(const Machine& machine, Config config);
[[nodiscard]] Check check_keys(Config config);
[[nodiscard]] Check check_models(Config config);
[[nodiscard]] Check check_logs(Config config);

}  // namespace posed::doctor
