#include "drivers/transport/udp_options.hpp"

#include <string>

#include "drivers/options.hpp"

namespace posed::drivers {

std::vector<OptionSpec> udp_options(std::string_view listen) {
  return {{.name = "listen",
           .default_value = std::string(listen),
           .help = "address and port that the device sends to"},
          {.name = "group",
           .default_value = std::string(),
           .help = "multicast group to join, with listen = \"0.0.0.0:PORT\"; left out: none"},
          {.name = "interface",
           .default_value = std::string(),
           .help = "network interface of the group, by name or address; left out: the system's "
                   "choice"},
          {.name = "peers",
           .default_value = std::string(),
           .help = "addresses that may send, separated by blanks; left out: this machine only"}};
}

UdpSettings udp_settings(const Options& options) {
  return {.sockets = {{.listen = option<std::string>(options, "listen"),
                       .group = option<std::string>(options, "group")}},
          .interface = option<std::string>(options, "interface"),
          .peers = words_option(options, "peers")};
}

}  // namespace posed::drivers
