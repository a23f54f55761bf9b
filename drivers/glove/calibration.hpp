// Calibration: what a decoder needs to turn a glove's raw values into the angles of a hand,
// compiled from a file (calibration_file.hpp) or a glove's defaults. Fixed size and const once
// made: it is shared with the reader thread as a pointer and swapped like a model.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

inline constexpr std::size_t kMaxSensors = 32;  // of one glove: raw and calibrated fit a Sample
inline constexpr std::size_t kMaxCurvePoints = 8;
inline constexpr std::size_t kMaxMapRows = 96;
inline constexpr std::size_t kMaxParameters = 8;

// Piecewise linear, going on with the slope of its first and last piece. Raw values ascend.
struct Curve {
  std::array<float, kMaxCurvePoints> raw{};
  std::array<float, kMaxCurvePoints> value{};
  std::uint8_t points = 0;  // at least 2 once made

  [[nodiscard]] static Curve line(double raw0, double value0, double raw1, double value1) noexcept;
  [[nodiscard]] float value_at(float raw_value) const noexcept;  // RT-safe
};

// One calibrated value's share in one hand45 channel.
struct MapRow {
  std::uint8_t sensor = 0;
  std::uint8_t channel = 0;  // of HandAngles
  float gain = 1.0F;         // radians a unit
  float offset_rad = 0.0F;
};

struct Calibration {
  std::size_t sensors = 0;
  std::array<Curve, kMaxSensors> curve{};         // [sensor of the Model]
  std::array<float, kMaxParameters> parameter{};  // [parameter of the Model]
  std::array<MapRow, kMaxMapRows> map{};
  std::size_t map_rows = 0;

  // Sums the map's rows. A channel without a row is zero; one with a value that is not valid is not
  // finite, so its joint is not valid. RT-safe.
  void map_to_hand(std::span<const float> value, const std::bitset<kMaxSensors>& valid,
                   HandAngles& angles) const noexcept;
};

}  // namespace posed::drivers::glove
