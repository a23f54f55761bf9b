// StreamFigures: what was counted about a stream since it came, beside its `stats`. Plain values.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/publish/duration_buckets.hpp"

namespace posed::publish {

inline constexpr std::array<std::string_view, 4> kQualityNames{"measured", "predicted", "held",
                                                               "stale"};  // by Quality

struct StreamFigures {
  std::string stream;
  double rate_hz = 0.0;       // expected frame rate; 0: unknown
  std::uint64_t decoded = 0;  // sequence of the last frame that the device gave
  std::array<std::uint64_t, kQualityNames.size()> published{};  // frames, by Quality
  std::uint64_t silences = 0;                                   // how often it became stale
  // Of the frames that are not stale, as v1::StreamStats has them for a second.
  DurationBuckets::Counts decode{}, publish{};
  std::vector<std::pair<std::string, DurationBuckets::Counts>> stages{};  // by name, in their order
};

}  // namespace posed::publish
