// What a config wants of the machine. Cold.
#pragma once

#include "daemon/config/daemon_config.hpp"
#include "daemon/tools/doctor/machine.hpp"

namespace posed::doctor {

// Whether it has a glove on a serial, HID or USB port.
[[nodiscard]] bool wants_gloves(const config::DaemonConfig& config);

// About how much of the disk recording needs. Bodies that come later count as four a source.
[[nodiscard]] double recorded_bytes_per_s(const config::DaemonConfig& config);

}  // namespace posed::doctor
