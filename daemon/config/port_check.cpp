#include "daemon/config/port_check.hpp"

#include <algorithm>
#include <map>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/listeners.hpp"
#include "drivers/transport/address.hpp"
#include "proto/text/clean.hpp"

namespace posed::config {
namespace {

// Sockets of a multicast group share its port.
bool clash(const Listener& a, const Listener& b) {
  return a.udp == b.udp && !(a.shared && b.shared) &&
         drivers::overlap(*drivers::parse_endpoint(a.endpoint),
                          *drivers::parse_endpoint(b.endpoint));
}

void add_shared_ports(const DaemonConfig& config, std::vector<PortClash>& clashes) {
  const std::vector<Listener> all = listeners_of(config);
  for (auto second = all.begin(); second != all.end(); ++second) {
    const auto first =
        std::find_if(all.begin(), second, [&](const Listener& one) { return clash(one, *second); });
    if (first == second) continue;
    clashes.push_back({.key = second->key,
                       .line = second->line,
                       .message = fmt::format("{} and {} cannot share the {} endpoint {}; give {}"
                                              " another port",
                                              first->who, second->who, second->udp ? "UDP" : "TCP",
                                              clean(second->endpoint), second->who)});
  }
  // What is no address in numbers is not among them: ipc, the name of an interface.
  if (clashes.empty() && config.publish_endpoint == config.control_endpoint &&
      has_fixed_port(config.publish_endpoint)) {
    clashes.push_back({.key = "control",
                       .message = fmt::format("publish and control cannot share the endpoint {};"
                                              " give control another one",
                                              clean(config.control_endpoint))});
  }
}

}  // namespace

std::vector<PortClash> port_clashes(const DaemonConfig& config) {
  std::vector<PortClash> clashes;
  add_shared_ports(config, clashes);
  for (const char* option : {"port", "id"}) {
    std::map<std::string, std::string> first;
    for (const StreamConfig& stream : config.streams) {
      const std::string glove = text_option(stream.options, option);
      if (glove.empty()) continue;
      const auto [known, is_new] = first.emplace(glove, stream.name);
      if (is_new) continue;
      clashes.push_back({.key = "stream",
                         .line = stream.line,
                         .message = fmt::format("{} and {} have the same {} {}; a glove serves one"
                                                " stream, so give each its own",
                                                in_quotes(known->second), in_quotes(stream.name),
                                                option, in_quotes(glove))});
    }
  }
  return clashes;
}

}  // namespace posed::config
