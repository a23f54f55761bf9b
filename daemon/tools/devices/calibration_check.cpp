#include "daemon/tools/devices/calibration_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/devices/calibrate_poses.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"

namespace posed::tools {
namespace {

using drivers::glove::Calibration;
using drivers::glove::kPoseNames;
using drivers::glove::Model;
using drivers::glove::Recorded;

constexpr double kApart_rad = 5.0 * kDegree;

struct PossibleRange {
  double least_deg, most_deg;
};
// What a flexible hand can do, with 10 degrees for a glove's errors: [joint] flexion of a finger,
// of the thumb, and spread of a finger's first joint.
constexpr std::array<PossibleRange, 3> kFingerRange{{{-50, 110}, {-25, 130}, {-25, 110}}};
constexpr std::array<PossibleRange, 3> kThumbRange{{{-60, 60}, {-40, 80}, {-35, 100}}};
constexpr PossibleRange kSpreadRange{-40, 40};

// "index MCP", "little MCP spread", "thumb CMC twist".
std::string joint_words(std::size_t channel) {
  constexpr std::array<const char*, 3> kFingerJoint{"MCP", "PIP", "DIP"};
  constexpr std::array<const char*, 3> kThumbJoint{"CMC", "MCP", "IP"};
  constexpr std::array<const char*, 3> kAxis{"", " spread", " twist"};
  const std::size_t finger = channel / kFingerChannels;
  const std::size_t joint = channel % kFingerChannels / 3;
  return fmt::format("{} {}{}", kFingerNames[finger],
                     finger == 0 ? kThumbJoint[joint] : kFingerJoint[joint], kAxis[channel % 3]);
}

// What is known of the channel; the thumb's spread and every twist are not judged.
const PossibleRange* possible(std::size_t channel) {
  const std::size_t finger = channel / kFingerChannels;
  const std::size_t joint = channel % kFingerChannels / 3;
  if (channel % 3 == 0) return finger == 0 ? &kThumbRange[joint] : &kFingerRange[joint];
  return channel % 3 == 1 && finger > 0 && joint == 0 ? &kSpreadRange : nullptr;
}

}  // namespace

std::vector<std::string> impossible_angles(const Model& model, const Calibration& calibration,
                                           const Recorded& recorded) {
  struct Worst {
    double beyond_deg = 0.0, angle_deg = 0.0;
    std::size_t pose = 0;
  };
  std::array<Worst, kHandChannels> worst{};
  for (std::size_t pose = 0; pose < recorded.size(); ++pose) {
    if (!drivers::glove::was_held(recorded[pose])) continue;
    const HandAngles angles = drivers::glove::angles_of(model, calibration, recorded[pose]);
    for (std::size_t c = 0; c < angles.size(); ++c) {
      const PossibleRange* const range = possible(c);
      const double deg = angles[c] / kDegree;
      if (range == nullptr || !std::isfinite(deg)) continue;
      const double beyond_deg = std::max(range->least_deg - deg, deg - range->most_deg);
      if (beyond_deg > worst[c].beyond_deg) worst[c] = {beyond_deg, deg, pose};
    }
  }
  std::vector<std::string> sentences;
  for (std::size_t c = 0; c < worst.size(); ++c) {
    if (worst[c].beyond_deg == 0.0) continue;
    sentences.push_back(fmt::format(
        "{} would be at {:.0f} degrees in the pose {}, which no hand can do (at most {:.0f}); "
        "calibrate again, and if it stays, look at the sensor",
        joint_words(c), worst[c].angle_deg, kPoseNames[worst[c].pose],
        worst[c].angle_deg < 0.0 ? possible(c)->least_deg : possible(c)->most_deg));
  }
  return sentences;
}

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
                                    joint_words(channel), off_rad / kDegree));
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
