#include "drivers/glove/glove_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers::glove {

void GloveEmulator::pose(std::size_t body, const Frame& frame) {
  if (body != 0 || frame.angle_count != kHandChannels) return;
  HandAngles angles = hand_angles(frame);
  for (double& angle_rad : angles) {
    if (!std::isfinite(angle_rad)) angle_rad = 0.0;
  }
  pose_hand(angles);
}

std::optional<double> raw_of_pose(const Calibration& calibration, std::size_t sensor,
                                  const HandAngles& angles) {
  const auto rows = std::span(calibration.map).first(calibration.map_rows);
  const auto row = std::ranges::find(rows, sensor, &MapRow::sensor);
  if (row == rows.end() || row->gain == 0.0F) return std::nullopt;
  const double value = (angles[row->channel] - static_cast<double>(row->offset_rad)) /
                       static_cast<double>(row->gain);
  // The inverse of a curve of two points.
  const Curve& curve = calibration.curve[sensor];
  const double raw0 = static_cast<double>(curve.raw[0]);
  const double value0 = static_cast<double>(curve.value[0]);
  const double slope =
      (static_cast<double>(curve.value[1]) - value0) / (static_cast<double>(curve.raw[1]) - raw0);
  return raw0 + (value - value0) / slope;
}

void add_text(std::string_view text, Emulator::Bytes& out) {
  const auto bytes = std::as_bytes(std::span(text));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

// The angles are the same for both hands.
Frame hand_frame(const HandAngles& angles) {
  static const Skeleton skeleton = hand_skeleton(Side::kRight);
  Frame frame;
  set_hand_angles(skeleton, angles, frame);
  return frame;
}

}  // namespace posed::drivers::glove
