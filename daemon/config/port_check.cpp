#include "daemon/config/port_check.hpp"

#include <map>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::config {
namespace {

// Who listens where, over TCP.
class Listeners {
 public:
  void add(std::string_view key, const std::string& who, std::string_view endpoint) {
    constexpr std::string_view kTcp = "tcp://";
    if (endpoint.starts_with(kTcp)) endpoint.remove_prefix(kTcp.size());
    const bool any_free_port = endpoint.ends_with(":*") || endpoint.ends_with(":0");
    if (endpoint.empty() || any_free_port) return;
    const auto [first, is_new] = first_.emplace(endpoint, who);
    if (is_new) return;
    clashes.push_back({.key = key,
                       .message = fmt::format("{} and {} cannot share the endpoint {}; give {}"
                                              " another port",
                                              first->second, who, clean(endpoint), who)});
  }

  std::vector<PortClash> clashes;

 private:
  std::map<std::string, std::string, std::less<>> first_;
};

// The glove that a stream is bound to by this option; empty: none.
std::string bound_to(const StreamConfig& stream, const std::string& option) {
  const auto found = stream.options.find(option);
  if (found == stream.options.end()) return {};
  const auto* text = std::get_if<std::string>(&found->second);
  return text == nullptr ? std::string() : *text;
}

}  // namespace

std::vector<PortClash> port_clashes(const DaemonConfig& config) {
  Listeners listeners;
  listeners.add("publish", "publish", config.publish_endpoint);
  listeners.add("control", "control", config.control_endpoint);
  for (const OutputConfig& output : config.outputs) {
    if (output.kind == OutputKind::kBvh) {
      listeners.add("output", "output " + in_quotes(output.name), output.listen);
    }
  }
  if (config.metrics) listeners.add("metrics", "metrics", config.metrics->listen);

  std::vector<PortClash> clashes = std::move(listeners.clashes);
  for (const char* option : {"port", "id"}) {
    std::map<std::string, std::string> first;
    for (const StreamConfig& stream : config.streams) {
      const std::string glove = bound_to(stream, option);
      if (glove.empty()) continue;
      const auto [known, is_new] = first.emplace(glove, stream.name);
      if (is_new) continue;
      clashes.push_back({.key = "stream",
                         .message = fmt::format("{} and {} have the same {} {}; a glove serves one"
                                                " stream, so give each its own",
                                                in_quotes(known->second), in_quotes(stream.name),
                                                option, in_quotes(glove))});
    }
  }
  return clashes;
}

}  // namespace posed::config
