#include "daemon/config/partner_check.hpp"

#include <algorithm>
#include <set>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "models/stage_type.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::config {
namespace {

bool has_partners(const StreamConfig& stream) {
  return std::ranges::any_of(
      stream.stages, [](const StageConfig& stage) { return !stage.type->partners.empty(); });
}

bool is_body(const DaemonConfig& config, const std::string& name) {
  return std::ranges::any_of(config.sources, [&](const SourceConfig& source) {
    return (source.all && name.starts_with(source.name + "-")) ||
           std::ranges::any_of(source.named, [&](const SourceConfig::NamedBody& named) {
             return named.stream.name == name;
           });
  });
}

// Why this stream cannot be a partner of `stream`; empty if it can.
std::string refusal(const DaemonConfig& config, const StreamConfig& stream, const StageType& stage,
                    const std::string& name) {
  if (name == stream.name) {
    return fmt::format("{} is this stream itself; name the stream of a glove", in_quotes(name));
  }
  const auto found = std::ranges::find(config.streams, name, &StreamConfig::name);
  if (found == config.streams.end()) {
    if (is_body(config, name)) {
      return fmt::format(
          "{} is a body of a source, whose skeleton is not known before it comes;"
          " name a [[stream]] that has a driver",
          in_quotes(name));
    }
    std::set<std::string> names;
    for (const StreamConfig& other : config.streams) {
      if (other.name != stream.name && !has_partners(other)) names.insert(other.name);
    }
    const std::string near = nearest(name, names);
    return fmt::format("there is no stream {}; {}", in_quotes(name),
                       near.empty() ? "add a [[stream]] table for the glove"
                                    : "the nearest is " + in_quotes(near));
  }
  if (has_partners(*found)) {
    return fmt::format(
        "stream {} has a stage {} itself, and a merged stream cannot be merged"
        " again; name the stream of a glove",
        in_quotes(name), stage.name);
  }
  return {};
}

void check_stream(const DaemonConfig& config, const StreamConfig& stream, Findings& findings) {
  for (const StageConfig& stage : stream.stages) {
    for (std::size_t i = 0; i < stage.partner_lines.size(); ++i) {
      const std::string parameter_name(stage.type->partners[i]);
      const auto& name = parameter<std::string>(stage.parameters, parameter_name);
      if (name.empty()) continue;
      const std::string sentence = refusal(config, stream, *stage.type, name);
      if (sentence.empty()) continue;
      findings.add_error(stage.partner_lines[i],
                         fmt::format("{}.{}: {}", stage.type->name, parameter_name, sentence));
    }
  }
}

}  // namespace

void check_partners(const DaemonConfig& config, Findings& findings) {
  for (const StreamConfig& stream : config.streams) check_stream(config, stream, findings);
  for (const SourceConfig& source : config.sources) {
    check_stream(config, source.every, findings);
    for (const auto& named : source.named) check_stream(config, named.stream, findings);
  }
}

}  // namespace posed::config
