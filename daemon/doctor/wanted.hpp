// What a config wants of the machine. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/doctor/machine.hpp"

namespace posed::doctor {

// The text of an option; empty if the driver has no such option.
[[nodiscard]] std::string text_option(const drivers::Options& options, std::string_view name);

// Whether it has a glove on a serial, HID or USB port.
[[nodiscard]] bool wants_gloves(const config::DaemonConfig& config);

// The sockets that `posed run` would bind to fixed ports. Addresses that are not numbers (the name
// of an interface), ports chosen by the system and ipc are left out.
[[nodiscard]] std::vector<Listener> listeners_of(const config::DaemonConfig& config);

// About how much of the disk recording needs. Bodies that come later count as four a source.
[[nodiscard]] double recorded_bytes_per_s(const config::DaemonConfig& config);

}  // namespace posed::doctor
