#include "daemon/tools/doctor/doctor.hpp"

namespace posed::doctor {

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

}  // namespace posed::doctor
