#include "drivers/glove/glove_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "drivers/glove/fit.hpp"
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
  return raw_at(calibration.curve[sensor], value);
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
