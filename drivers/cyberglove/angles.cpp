#include "drivers/cyberglove/angles.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/glove/angle_map.hpp"

namespace posed::drivers::cyberglove {
namespace {

constexpr float kMaxThumbRoll_rad = 0.5F;
constexpr double kDefaultBias = 0.248;

// Radians per count in the library's formula -gain * (raw - offset), recovered from the steps in
// real recordings: GraspDB14, and for the distal joints of 22-sensor gloves the LIBRAS poses. The
// sensor between index and middle counts in the opposite direction. The offsets are chosen for
// posed, in the range where the logs of other drivers show extended fingers; those of the thumb so
// that a count of 70 to 90 is a thumb beside the index finger, which is not the library's zero.
struct DefaultSensor {
  std::string_view name;
  double gain;
  double offset;
};
constexpr std::array<DefaultSensor, kSensors> kDefaults{{
    {"thumb_roll", 0.01584, -2.5}, {"thumb_mcp", 0.01459, 99},   {"thumb_ip", 0.01427, 78},
    {"thumb_abd", 0.00502, 22.5},  {"index_mcp", 0.01616, 80},   {"index_pip", 0.01459, 70},
    {"index_dip", 0.00753, 70},    {"index_abd", 0.00449, 128},  {"middle_mcp", 0.01725, 80},
    {"middle_pip", 0.01804, 70},   {"middle_dip", 0.01051, 70},  {"middle_abd", -0.00449, 120},
    {"ring_mcp", 0.01757, 80},     {"ring_pip", 0.01788, 70},    {"ring_dip", 0.01051, 70},
    {"ring_abd", 0.00612, 140},    {"little_mcp", 0.01663, 80},  {"little_pip", 0.01820, 70},
    {"little_dip", 0.00988, 70},   {"little_abd", 0.00596, 140}, {"palm_arch", 0.00910, 90},
    {"wrist_pitch", 0.00863, 100}, {"wrist_yaw", 0.00392, 128},
}};

constexpr std::array<std::size_t, 6> kMirrored{kThumbAbd, kIndexAbd,  kMiddleAbd,
                                               kRingAbd,  kLittleAbd, kWristYaw};

// DIP = sign(PIP) |0.32 PIP^2 + 0.17 PIP|: VirtualHand's own recordings of 18-sensor gloves follow
// this formula; the published source lacks the sign.
float distal(float pip) noexcept {
  return std::copysign(std::abs(0.32F * pip * pip + 0.17F * pip), pip);
}

void compute_abductions(float bias, std::span<float> value, Valid& valid) noexcept {
  const bool known = valid[kMiddleAbd] && valid[kRingAbd];
  valid[kIndexAbd] = valid[kMiddleAbd] = valid[kRingAbd] = known;
  valid[kLittleAbd] = known && valid[kLittleAbd];
  const float index_middle = value[kMiddleAbd];
  const float middle = -bias * (value[kRingAbd] + index_middle);
  value[kIndexAbd] = index_middle + middle;
  value[kMiddleAbd] = middle;
  value[kRingAbd] += middle;
  value[kLittleAbd] += value[kRingAbd];
}

// A sensor that was measured is fitted.
template <Side kHand>
void compute_measured(const glove::Calibration& calibration, std::span<float> value,
                      Valid& valid) noexcept {
  const auto fitted = static_cast<std::uint32_t>(valid.to_ulong());
  compute_angles(calibration.parameter[kAbductionBias], kHand, fitted, value, valid);
}

void uncompute_left(std::span<double> value) noexcept { uncompute_angles(Side::kLeft, value); }
void uncompute_right(std::span<double> value) noexcept { uncompute_angles(Side::kRight, value); }

}  // namespace

Result<glove::Model> glove_model(Side hand) {
  glove::Model model{
      .driver = "cyberglove", .sensors = {}, .parameters = {{"abduction_bias", kDefaultBias}}};
  for (const DefaultSensor& sensor : kDefaults) {
    constexpr double kCounts = 100.0;
    model.sensors.push_back(
        {.name = std::string(sensor.name),
         .raw_min = 1.0,
         .raw_max = 255.0,
         .curve = glove::Curve::line(sensor.offset, 0.0, sensor.offset + kCounts,
                                     -sensor.gain * kCounts)});
  }
  if (hand == Side::kLeft) {
    for (const std::size_t i : kMirrored) model.sensors[i].map_sign = -1.0;
  }
  model.compute =
      hand == Side::kLeft ? compute_measured<Side::kLeft> : compute_measured<Side::kRight>;
  model.uncompute = hand == Side::kLeft ? uncompute_left : uncompute_right;
  return glove::with_device_table(std::move(model), "cyberglove");
}

RT_SAFE void compute_angles(float abduction_bias, Side hand, std::uint32_t fitted,
                            std::span<float> value, Valid& valid) noexcept {
  value[kThumbRoll] = std::min(value[kThumbRoll], kMaxThumbRoll_rad);
  compute_abductions(abduction_bias, value, valid);
  for (const std::size_t dip : {kIndexDip, kMiddleDip, kRingDip, kLittleDip}) {
    if ((fitted >> dip & 1U) != 0) continue;
    value[dip] = distal(value[dip - 1]);
    valid[dip] = valid[dip - 1];
  }
  if (hand == Side::kLeft) {
    for (const std::size_t i : kMirrored) value[i] = -value[i];
  }
}

void uncompute_angles(Side hand, std::span<double> value) noexcept {
  if (hand == Side::kLeft) {
    for (const std::size_t i : kMirrored) value[i] = -value[i];
  }
  value[kLittleAbd] -= value[kRingAbd];
  value[kRingAbd] -= value[kMiddleAbd];
  value[kMiddleAbd] = value[kIndexAbd] - value[kMiddleAbd];
  value[kIndexAbd] = 0.0;
}

}  // namespace posed::drivers::cyberglove
