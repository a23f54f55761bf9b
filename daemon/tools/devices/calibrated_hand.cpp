#include "daemon/tools/devices/calibrated_hand.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/picture/braille.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::tools {
namespace {

using drivers::glove::Recorded;

constexpr int kGap = 2;           // blanks between the hands
constexpr int kMostColumns = 18;  // of a hand

bool was_held(const Recorded& recorded, std::size_t pose) {
  return std::ranges::any_of(recorded[pose], [](const auto& sensor) { return sensor.count > 0; });
}

}  // namespace

std::vector<std::string> calibrated_hand(const drivers::glove::Model& model,
                                         const drivers::glove::Calibration& calibration, Side hand,
                                         const Recorded& recorded, int columns, int rows) {
  const auto skeleton = std::make_shared<const Skeleton>(hand_skeleton(hand));
  const picture::FigureShape shape(skeleton);
  const picture::Camera camera(picture::View::kThreeQuarter, shape.facing(0.0));
  picture::StripRow poses;
  for (std::size_t p = 0; p < drivers::glove::kPoses; ++p) {
    if (!was_held(recorded, p)) continue;
    HandAngles angles = drivers::glove::angles_of(model, calibration, recorded[p]);
    for (double& angle_rad : angles) angle_rad = std::isfinite(angle_rad) ? angle_rad : 0.0;
    Frame frame;
    frame.skeleton = skeleton->id;
    frame.joint_count = static_cast<std::uint16_t>(skeleton->joints.size());
    set_hand_angles(*skeleton, angles, frame);
    poses.poses.push_back(
        {.figure = shape.pose(frame), .caption = std::string(drivers::glove::kPoseNames[p])});
  }
  const int hands = static_cast<int>(poses.poses.size());
  if (hands == 0 || rows < 2) return {};
  const int width = std::clamp((columns + kGap) / hands - kGap, 1, kMostColumns);
  const picture::StripLayout room = picture::layout_of({poses}, camera, 1.0, false);
  std::vector<std::string> lines(static_cast<std::size_t>(rows));
  for (const auto& [figure, caption] : poses.poses) {
    auto drawn = picture::braille(figure, camera, room, width, rows - 1);
    drawn.push_back(fmt::format("{:^{}.{}}", caption, width, width));
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!lines[i].empty()) lines[i] += std::string(kGap, ' ');
      lines[i] += drawn[i];
    }
  }
  return lines;
}

}  // namespace posed::tools
