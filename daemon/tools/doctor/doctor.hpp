// `posed doctor`: looks at this computer, and at what a config wants of it. Each check is a pure
// function of its arguments, except that it reads files. Cold.
#pragma once

#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/doctor/check.hpp"
#include "daemon/tools/doctor/machine.hpp"

namespace posed::doctor {

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
