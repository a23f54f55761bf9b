#include "daemon/tools/devices/calibration_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
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

}  // namespace

std::vector<std::string> differences(const Model& model, const Calibration& before,
                                     const Calibration& now, const Recorded& recorded) {
  std::array<double, kHandChannels> apart_rad{};
  for (std::size_t pose = 0; pose < recorded.size(); ++pose) {
    if (!drivers::glove::was_held(recorded[pose])) continue;
    const HandAngles a = drivers::glove::angles_of(model, before, recorded[pose]);
    const HandAngles b = drivers::glove::angles_of(model, now, recorded[pose]);
    for (std::size_t c = 0; c < a.size(); ++c) {
      const double off_rad = std::abs(a[c] - b[c]);
      if (std::isfinite(off_rad)) apart_rad[c] = std::max(apart_rad[c], off_rad);
    }
  }
  std::vector<std::pair<double, std::size_t>> far;
  for (std::size_t c = 0; c < apart_rad.size(); ++c) {
    if (apart_rad[c] > kApart_rad) far.emplace_back(apart_rad[c], c);
  }
  std::ranges::sort(far, std::greater<>());
  std::vector<std::string> sentences;
  for (const auto& [off_rad, channel] : far) {
    sentences.push_back(fmt::format("{} differs by {:.0f} degrees from the last calibration",
                                    drivers::glove::joint_words(channel), off_rad / kDegree));
  }
  if (far.empty()) {
    sentences.push_back(
        fmt::format("no joint differs by more than {:.0f} degrees from the last "
                    "calibration",
                    std::ceil(std::ranges::max(apart_rad) / kDegree)));
  }
  return sentences;
}

}  // namespace posed::tools
