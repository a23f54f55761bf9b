#include "daemon/tools/relay/merged_stats.hpp"

#include "proto/frame/time.hpp"

namespace posed::relay {
namespace {

constexpr std::int64_t kNoStats_ns = 3 * kNanosPerSecond;  // three stats are missing

}  // namespace

std::optional<std::string> MergedStats::take(std::size_t upstream, std::string_view bytes,
                                             std::int64_t now_ns, bool& sound) {
  Heard& heard = heard_[upstream];
  sound = heard.stats.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  if (!sound) {
    heard.ever = false;
    return std::nullopt;
  }
  heard.ever = true;
  heard.at_ns = now_ns;
  if (heard_.size() == 1) return std::string(bytes);
  for (v1::StreamStats& stream : *heard.stats.mutable_stream()) {
    // What is set already comes from a relay before this one.
    if (stream.has_monotonic_to_utc_ns()) continue;
    stream.set_monotonic_to_utc_ns(heard.stats.monotonic_to_utc_ns());
  }
  const auto answers = [&](const Heard& one) {
    return one.ever && now_ns - one.at_ns < kNoStats_ns;
  };
  for (std::size_t i = 0; i < upstream; ++i) {
    if (answers(heard_[i])) return std::nullopt;  // an earlier one gives the beat
  }
  v1::Stats merged = heard.stats;
  for (std::size_t i = upstream + 1; i < heard_.size(); ++i) {
    if (!answers(heard_[i])) continue;
    merged.mutable_stream()->MergeFrom(heard_[i].stats.stream());
    merged.mutable_source()->MergeFrom(heard_[i].stats.source());
  }
  return merged.SerializeAsString();
}

}  // namespace posed::relay
