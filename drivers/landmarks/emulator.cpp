#include "drivers/landmarks/emulator.hpp"

#include <cmath>
#include <numbers>

#include "drivers/landmarks/fit.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers::landmarks {
namespace {

constexpr double kFist_hz = 0.5;     // opened and closed so often
constexpr double kClosed_rad = 1.2;  // each joint in a fist

HandAngles closing(double time_s) {
  HandAngles angles{};
  const double closed = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * kFist_hz * time_s);
  for (std::size_t f = 1; f < kFingers; ++f) {
    for (std::size_t j = 0; j < kFingerJoints; ++j) {
      angles[f * kFingerChannels + 3 * j] = kClosed_rad * closed;
    }
  }
  angles[2] = 0.75 * closed;  // the thumb goes across the palm
  angles[3] = angles[6] = 0.6 * closed;
  return angles;
}

// From the wrist's frame to the camera's: fingers up, the palm towards it.
Vec3f before_camera(const Vec3f& point_m) { return {point_m[0], -point_m[2], point_m[1]}; }

}  // namespace

LandmarksEmulator::LandmarksEmulator(double rate_hz) : pace_(nanoseconds(1.0 / rate_hz)) {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    Hand& hand = hands_[static_cast<std::size_t>(side)];
    hand.skeleton = std::make_shared<const Skeleton>(hand_skeleton(side));
    set_hand_angles(*hand.skeleton, HandAngles{}, hand.frame);
  }
  pace_.start(0);
}

void LandmarksEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= hands_.size()) return;
  hands_[body].posed = true;
  hands_[body].frame = frame;
}

void LandmarksEmulator::emit(std::int64_t now_ns, Bytes& out) {
  Message message;
  message.time_s = seconds(pace_.due_ns());
  pace_.step(now_ns);
  for (std::size_t body = 0; body < hands_.size(); ++body) {
    Hand& hand = hands_[body];
    if (!hand.seen) continue;
    if (!hand.posed) set_hand_angles(*hand.skeleton, closing(message.time_s), hand.frame);
    TrackedHand& tracked = message.hands[message.count++];
    tracked.side = static_cast<Side>(body);
    tracked.score = 1.0;
    tracked.point_m = landmarks_of(*hand.skeleton, hand.frame);
    for (Vec3f& point_m : tracked.point_m) point_m = before_camera(point_m);
  }
  const std::string text = write_message(message);
  const auto bytes = std::as_bytes(std::span(text));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace posed::drivers::landmarks
