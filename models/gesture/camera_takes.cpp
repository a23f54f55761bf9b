#include "models/gesture/camera_takes.hpp"

#include <array>
#include <sstream>
#include <string_view>

#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"

namespace posed::gesture {
namespace {

constexpr std::size_t kMinFrames = 6;  // a gesture that the take's begin or end cuts is left out

// Finger, joint, axis of each column: those that a glove has sensors for.
constexpr std::array<std::array<int, 3>, 19> kChannels{{{0, 0, 2},
                                                        {0, 1, 0},
                                                        {0, 2, 0},
                                                        {0, 0, 1},
                                                        {1, 0, 0},
                                                        {1, 1, 0},
                                                        {1, 2, 0},
                                                        {1, 0, 1},
                                                        {2, 0, 0},
                                                        {2, 1, 0},
                                                        {2, 2, 0},
                                                        {3, 0, 0},
                                                        {3, 1, 0},
                                                        {3, 2, 0},
                                                        {3, 0, 1},
                                                        {4, 0, 0},
                                                        {4, 1, 0},
                                                        {4, 2, 0},
                                                        {4, 0, 1}}};

// A row of a take is a picture, a tenth of a second after the one before: the gesture, and what the
// landmarks driver made of the points [deg], in the order of kChannels.
Performance read_camera_take(std::string_view text) {
  Performance take;
  take.clip.path = "drawn hand before a camera";
  take.clip.rate_hz = kCameraRate_hz;
  std::istringstream rows{std::string(text)};
  for (std::string label; rows >> label;) {
    const double now_s = static_cast<double>(take.clip.angles.size()) / kCameraRate_hz;
    take.clip.time_s.push_back(now_s);
    HandAngles& angles = take.clip.angles.emplace_back();
    for (const auto& [finger, joint, axis] : kChannels) {
      double angle_deg = 0.0;
      rows >> angle_deg;
      angles[finger * kFingerChannels + 3 * joint + axis] = kDegree * angle_deg;
    }
    if (take.labels.empty() || take.labels.back().name != label) {
      take.labels.push_back({now_s, now_s, label, static_cast<int>(take.labels.size()) + 1});
    }
    take.labels.back().end_s = now_s + 1.0 / kCameraRate_hz;
  }
  std::erase_if(take.labels, [](const clip::LabelSegment& segment) {
    return segment.end_s - segment.start_s < (kMinFrames - 0.5) / kCameraRate_hz;
  });
  return take;
}

}  // namespace

std::vector<Performance> camera_takes() {
  std::vector<Performance> takes;
  for (const ConfigText& take : camera_texts()) takes.push_back(read_camera_take(take.content));
  return takes;
}

}  // namespace posed::gesture
