#include "daemon/tools/devices/calibration_check.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "drivers/glove/possible_angles.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"

namespace posed::tools {
namespace {

using drivers::glove::Calibration;
using drivers::glove::Model;
using drivers::glove::Recorded;

constexpr double kApart_rad = 5.0 * kDegree;
constexpr double kUnlike_rad = 7.0 * kDegree;

}  // namespace

Differences differences(const Model& model, const Calibration& before, const Calibration& now,
                        const Recorded& recorded) {
  Differences found;
  std::bitset<kHandChannels> mapped;
  for (const auto& row : std::span(now.map).first(now.map_rows)) mapped.set(row.channel);
  std::bitset<kHandChannels> measured;
  std::array<double, kHandChannels> apart_rad{};
  for (std::size_t pose = 0; pose < recorded.size(); ++pose) {
    if (!drivers::glove::was_held(recorded[pose])) continue;
    const HandAngles a = drivers::glove::angles_of(model, before, recorded[pose]);
    const HandAngles b = drivers::glove::angles_of(model, now, recorded[pose]);
    for (std::size_t c = 0; c < a.size(); ++c) {
      const double off_rad = std::abs(a[c] - b[c]);
      if (!std::isfinite(off_rad)) continue;
      measured.set(c);
      apart_rad[c] = std::max(apart_rad[c], off_rad);
    }
  }
  found.joints = static_cast<int>((mapped & measured).count());
  std::vector<std::pair<double, std::size_t>> far;
  for (std::size_t c = 0; c < apart_rad.size(); ++c) {
    if (apart_rad[c] > kApart_rad) far.emplace_back(apart_rad[c], c);
  }
  std::ranges::sort(far, std::greater<>());
  for (const auto& [off_rad, channel] : far) {
    if (off_rad > kUnlike_rad) ++found.unlike;
    found.sentences.push_back(fmt::format("{} differs by {:.0f} degrees from the last calibration",
                                          drivers::glove::joint_words(channel), off_rad / kDegree));
  }
  if (far.empty()) {
    found.sentences.push_back(
        fmt::format("no joint differs by more than {:.0f} degrees from the last "
                    "calibration",
                    std::ceil(std::ranges::max(apart_rad) / kDegree)));
  }
  return found;
}

}  // namespace posed::tools
