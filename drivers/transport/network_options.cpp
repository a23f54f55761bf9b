#include "drivers/transport/network_options.hpp"

#include <string>
#include <utility>

#include "drivers/options.hpp"

namespace posed::drivers {
namespace {

bool over_tcp(const Options& options) { return option<std::string>(options, "link") == "tcp"; }

ListenSettings tcp_listen_settings(const Options& options) {
  return {.endpoint = option<std::string>(options, "listen"),
          .peers = words_option(options, "peers"),
          .device = "device"};
}

}  // namespace

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

std::vector<OptionSpec> network_options(std::string_view link, std::string_view listen) {
  auto specs = udp_options(listen);
  specs.push_back({.name = "link",
                   .default_value = std::string(link),
                   .help = "udp or tcp, as the system is set to"});
  specs.push_back({.name = "connect",
                   .default_value = std::string(),
                   .help = "with link = tcp, address and port of a system that waits for us; left "
                           "out: it connects to `listen`"});
  return specs;
}

Result<> check_network(const Options& options) {
  const auto& link = option<std::string>(options, "link");
  const auto& connect = option<std::string>(options, "connect");
  if (link != "udp" && link != "tcp") return misuse("link should be \"udp\" or \"tcp\"");
  if (!connect.empty() && link == "udp") {
    return misuse("connect is for link = \"tcp\"; over UDP the system sends to `listen`");
  }
  if (link == "udp") return check_udp(udp_settings(options));
  for (const std::string name : {"group", "interface"}) {
    if (!option<std::string>(options, name).empty()) {
      return misuse(name + " is for multicast: leave it out with link = \"tcp\"");
    }
  }
  if (!connect.empty() && !words_option(options, "peers").empty()) {
    return misuse("peers are those who may connect to us: leave them out beside connect");
  }
  return connect.empty() ? check_listen(tcp_listen_settings(options)) : check_connect(connect);
}

std::string network_identity(const Options& options) {
  const auto& connect = option<std::string>(options, "connect");
  return option<std::string>(options, "link") + ' ' +
         (connect.empty() ? option<std::string>(options, "listen") : connect);
}

Result<std::unique_ptr<Transport>> open_network(const Options& options, TransportFactory& ports) {
  TRY(check_network(options));
  if (!over_tcp(options)) {
    auto sockets = TRY(ports.udp(udp_settings(options)));
    return sockets;
  }
  const auto& connect = option<std::string>(options, "connect");
  auto link =
      TRY(connect.empty() ? ports.accept(tcp_listen_settings(options)) : ports.connect(connect));
  return make_link_transport(std::move(link));
}

}  // namespace posed::drivers
