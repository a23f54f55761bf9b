#include "drivers/glove/calibration.hpp"

#include <algorithm>
#include <limits>

namespace posed::drivers::glove {

Curve Curve::line(double raw0, double value0, double raw1, double value1) noexcept {
  Curve curve;
  curve.points = 2;
  curve.raw[0] = static_cast<float>(raw0);
  curve.raw[1] = static_cast<float>(raw1);
  curve.value[0] = static_cast<float>(value0);
  curve.value[1] = static_cast<float>(value1);
  return curve;
}

RT_SAFE float Curve::value_at(float raw_value) const noexcept {
  std::size_t piece = 1;  // ends at this point; the first and the last are extended outwards
  while (piece + 1 < points && raw_value > raw[piece]) ++piece;
  const float share = (raw_value - raw[piece - 1]) / (raw[piece] - raw[piece - 1]);
  return value[piece - 1] + share * (value[piece] - value[piece - 1]);
}

RT_SAFE void Calibration::remove_crosstalk(std::span<float> value,
                                           const std::bitset<kMaxSensors>& valid) const noexcept {
  if (crosstalk_rows == 0) return;
  std::array<float, kMaxSensors> shown{};
  std::copy_n(value.begin(), std::min(value.size(), shown.size()), shown.begin());
  for (std::size_t r = 0; r < crosstalk_rows; ++r) {
    const Crosstalk& row = crosstalk[r];
    if (std::max(row.sensor, row.of) < value.size() && valid[row.of]) {
      value[row.sensor] -= row.share * shown[row.of];
    }
  }
}

RT_SAFE void Calibration::map_to_hand(std::span<const float> value,
                                      const std::bitset<kMaxSensors>& valid,
                                      HandAngles& angles) const noexcept {
  angles.fill(0.0);
  for (std::size_t r = 0; r < map_rows; ++r) {
    const MapRow& row = map[r];
    const bool known = row.sensor < value.size() && valid[row.sensor];
    angles[row.channel] += known ? static_cast<double>(row.gain) * value[row.sensor] +
                                       static_cast<double>(row.offset_rad)
                                 : std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace posed::drivers::glove
