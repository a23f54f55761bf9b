// Any bytes as a hand CSV: accepted or refused, never a crash or a hang; times increase, and
// present values are finite.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "proto/clip/hand_clip.hpp"
#include "tests/fuzz/demand.hpp"

namespace {

using posed::fuzz::demand;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  auto clip = posed::clip::parse_hand_csv(text, "fuzz.csv");
  if (!clip) return 0;
  demand(clip->rate_hz > 0.0 && std::isfinite(clip->rate_hz));
  demand(!clip->angles.empty() && clip->time_s.size() == clip->angles.size());
  for (std::size_t i = 0; i < clip->time_s.size(); ++i) {
    demand(std::isfinite(clip->time_s[i]) && (i == 0 || clip->time_s[i] > clip->time_s[i - 1]));
  }
  for (const auto& angles : clip->angles) {
    for (const double angle_rad : angles) demand(!std::isinf(angle_rad));
  }
  posed::clip::fill_gaps(*clip);
  const auto whole = posed::clip::clip_of_hand(*clip, "adult");
  demand(whole.has_value() && whole->channels.allFinite());
  return 0;
}
