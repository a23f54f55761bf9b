// The sockets to which a config binds. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/daemon_config.hpp"

namespace posed::config {

// A socket that the daemon binds.
struct Listener {
  std::string who{};       // "publish", "stream 'right'"
  bool udp = false;        // else TCP
  std::string endpoint{};  // "127.0.0.1:5570", numbers only
  bool shared = false;     // a multicast group, which several sockets receive
  std::string_view key{};  // of its table in the config
  int line = 0;            // of that table where the key has several; 0: unknown
};

// The text of an option; empty if the driver has no such option.
[[nodiscard]] std::string text_option(const drivers::Options& options, std::string_view name);

// True when the endpoint names its port; with ":0" or ":*" the system chooses one.
[[nodiscard]] bool has_fixed_port(std::string_view endpoint);

// The sockets that `posed run` would bind to fixed ports. Addresses that are not numbers (the name
// of an interface), ports chosen by the system and ipc are left out.
[[nodiscard]] std::vector<Listener> listeners_of(const DaemonConfig& config);

}  // namespace posed::config
