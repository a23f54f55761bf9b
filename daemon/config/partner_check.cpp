#include "daemon/config/config_file.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "models/stage_type.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::config {
namespace {

// All streams of a config, and which of them a name may stand for. The bodies of a source that no
// table names count as one stream, SourceConfig::every.
class StreamGraph {
 public:
  explicit StreamGraph(const DaemonConfig& config) : config_(config) {
    for (const StreamConfig& stream : config.streams) streams_.push_back(&stream);
    for (const SourceConfig& source : config.sources) {
      for (const auto& named : source.named) streams_.push_back(&named.stream);
    }
  }

  // Empty: there is no such stream.
  [[nodiscard]] std::vector<const StreamConfig*> named(const std::string& name) const {
    const auto found = std::ranges::find(streams_, name, &StreamConfig::name);
    if (found != streams_.end()) return {*found};
    std::vector<const StreamConfig*> bodies;
    for (const SourceConfig& source : config_.sources) {
      if (source.all && name.starts_with(source.name + "-")) bodies.push_back(&source.every);
    }
    return bodies;
  }

  // Whether a stream of this name needs frames of `stream`, directly or by its partners.
  [[nodiscard]] bool needs(const std::string& name, const StreamConfig& stream) const {
    std::set<const StreamConfig*> seen;
    return needs(name, stream, seen);
  }

  [[nodiscard]] std::set<std::string> names_but(const StreamConfig& stream) const {
    std::set<std::string> names;
    for (const StreamConfig* other : streams_) {
      if (other != &stream) names.insert(other->name);
    }
    return names;
  }

 private:
  bool needs(const std::string& name, const StreamConfig& stream,
             std::set<const StreamConfig*>& seen) const {
    for (const StreamConfig* one : named(name)) {
      if (one == &stream) return true;
      if (!seen.insert(one).second) continue;
      for (const StageConfig& stage : one->stages) {
        for (const std::string_view partner : stage.type->partners) {
          const auto& next = parameter<std::string>(stage.parameters, std::string(partner));
          if (!next.empty() && needs(next, stream, seen)) return true;
        }
      }
    }
    return false;
  }

  const DaemonConfig& config_;
  std::vector<const StreamConfig*> streams_;
};

// Why the stream of this name cannot be a partner of `stream`; empty if it can.
std::string refusal(const StreamGraph& graph, const StreamConfig& stream, const StageType& stage,
                    const std::string& name) {
  if (name == stream.name) {
    return fmt::format("{} is this stream itself; name another", in_quotes(name));
  }
  if (graph.named(name).empty()) {
    const std::string near = nearest(name, graph.names_but(stream));
    return fmt::format(
        "there is no stream {}; {}", in_quotes(name),
        near.empty() ? "add a [[stream]] table for it" : "the nearest is " + in_quotes(near));
  }
  if (graph.needs(name, stream)) {
    return fmt::format(
        "stream {} needs this stream itself for its stage {}, or by its partners, and neither can"
        " come first; name a stream that does without",
        in_quotes(name), stage.name);
  }
  return {};
}

void check_stream(const StreamGraph& graph, const StreamConfig& stream, Findings& findings) {
  for (const StageConfig& stage : stream.stages) {
    for (std::size_t i = 0; i < stage.partner_lines.size(); ++i) {
      const std::string parameter_name(stage.type->partners[i]);
      const auto& name = parameter<std::string>(stage.parameters, parameter_name);
      if (name.empty()) continue;
      const std::string sentence = refusal(graph, stream, *stage.type, name);
      if (sentence.empty()) continue;
      findings.add_error(stage.partner_lines[i],
                         fmt::format("{}.{}: {}", stage.type->name, parameter_name, sentence));
    }
  }
}

}  // namespace

void check_partners(const DaemonConfig& config, Findings& findings) {
  const StreamGraph graph(config);
  for (const StreamConfig& stream : config.streams) check_stream(graph, stream, findings);
  for (const SourceConfig& source : config.sources) {
    check_stream(graph, source.every, findings);
    for (const auto& named : source.named) check_stream(graph, named.stream, findings);
  }
}

}  // namespace posed::config
