#include "daemon/config/listeners.hpp"

#include <variant>

#include "drivers/transport/address.hpp"
#include "proto/text/clean.hpp"

namespace posed::config {
namespace {

// The address behind "tcp://", with numbers for every address of this machine ("*"). Empty if the
// endpoint is none of TCP.
std::string tcp_address(std::string_view endpoint) {
  constexpr std::string_view kTcp = "tcp://";
  if (!endpoint.starts_with(kTcp)) return {};
  std::string address(endpoint.substr(kTcp.size()));
  if (address.starts_with("*:")) address.replace(0, 1, "0.0.0.0");
  if (address.starts_with("localhost:")) address.replace(0, 9, "127.0.0.1");
  return address;
}

bool is_on(const drivers::Options& options, const std::string& name) {
  const auto found = options.find(name);
  const auto* on = found == options.end() ? nullptr : std::get_if<bool>(&found->second);
  return on != nullptr && *on;
}

// Without an endpoint where the device is on a port, or posed connects to it. A device without a
// `link` sends datagrams, unless it is a described glove: that one connects over TCP.
Listener data_of(const drivers::Options& options) {
  const std::string link = text_option(options, "link");
  const bool connects = link == "tcp" && !text_option(options, "connect").empty();
  if (connects || (!link.empty() && link != "tcp" && link != "udp")) return {};
  return {.udp = link == "udp" || (link.empty() && !options.contains("port")),
          .endpoint = text_option(options, "listen"),
          .shared = !text_option(options, "group").empty() && !is_on(options, "unicast")};
}

void add_device(std::vector<Listener>& all, std::string_view key, const std::string& name,
                const drivers::Options& options, int line) {
  const Listener command{.udp = true, .endpoint = text_option(options, "command_listen")};
  for (Listener one : {data_of(options), command}) {
    one.who = std::string(key) + " " + in_quotes(name);
    one.key = key;
    one.line = line;
    all.push_back(std::move(one));
  }
}

}  // namespace

std::string text_option(const drivers::Options& options, std::string_view name) {
  const auto found = options.find(std::string(name));
  if (found == options.end() || !std::holds_alternative<std::string>(found->second)) return {};
  return std::get<std::string>(found->second);
}

bool has_fixed_port(std::string_view endpoint) {
  return !endpoint.ends_with(":0") && !endpoint.ends_with(":*");
}

std::vector<Listener> listeners_of(const DaemonConfig& config) {
  std::vector<Listener> all;
  const auto add = [&](std::string_view key, bool udp, const std::string& endpoint) {
    all.push_back({.who = std::string(key), .udp = udp, .endpoint = endpoint, .key = key});
  };
  add("publish", false, tcp_address(config.publish_endpoint));
  add("control", false, tcp_address(config.control_endpoint));
  if (config.trigger) add("trigger", true, config.trigger->listen);
  for (const OutputConfig& output : config.outputs) {
    // The ports of ros2 are DDS's, which takes others if they are not free.
    if (!output.to.empty() || output.kind == OutputKind::kRos2) continue;
    all.push_back({.who = "output " + in_quotes(output.name),
                   .udp = output.kind == OutputKind::kNatNet,
                   .endpoint = output.listen,
                   .key = "output",
                   .line = output.line});
  }
  if (config.metrics) add("metrics", false, config.metrics->listen);
  for (const StreamConfig& stream : config.streams) {
    add_device(all, "stream", stream.name, stream.options, stream.line);
  }
  for (const SourceConfig& source : config.sources) {
    add_device(all, "source", source.name, source.options, source.line);
  }
  std::erase_if(all, [](const Listener& one) {
    return !has_fixed_port(one.endpoint) || !drivers::parse_endpoint(one.endpoint);
  });
  return all;
}

}  // namespace posed::config
