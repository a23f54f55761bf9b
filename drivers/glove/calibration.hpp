// Calibration: the data that a decoder needs to turn a glove's raw values into hand angles,
// compiled from a file (calibration_file.hpp) or from a glove's defaults. Fixed size; const after
// construction: it is shared with the reader thread by pointer and swapped like a model.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"

namespace posed::drivers::glove {

// Per glove: raw and calibrated values must fit a Sample.
inline constexpr std::size_t kMaxSensors = 32;
// In the sample of a glove: calibrated and raw values of its sensors, and extras.
inline constexpr std::size_t kMaxGloveValues = 64;
inline constexpr std::size_t kMaxCurvePoints = 8;
inline constexpr std::size_t kMaxMapRows = 96;
inline constexpr std::size_t kMaxParameters = 8;
inline constexpr std::size_t kMaxCrosstalk = 64;

// Piecewise linear; beyond its ends it continues with the slope of the first or last piece. Raw
// values increase.
struct Curve {
  std::array<float, kMaxCurvePoints> raw{};
  std::array<float, kMaxCurvePoints> value{};
  std::uint8_t points = 0;  // at least 2 after construction

  [[nodiscard]] static Curve line(double raw0, double value0, double raw1, double value1) noexcept;
  RT_SAFE [[nodiscard]] float value_at(float raw_value) const noexcept;
};

// The contribution of one calibrated value to one hand45 channel.
struct MapRow {
  std::uint8_t sensor = 0;
  std::uint8_t channel = 0;  // index in HandAngles
  float gain = 1.0F;         // radians per unit
  float offset_rad = 0.0F;
};

// How much of another sensor's value a sensor shows, because the glove's cloth or the hand itself
// moves it along.
struct Crosstalk {
  std::uint8_t sensor = 0, of = 0;
  float share = 0.0F;
};

struct Calibration {
  std::size_t sensors = 0;
  std::array<Curve, kMaxSensors> curve{};         // [sensor of the Model]
  std::array<float, kMaxParameters> parameter{};  // [parameter of the Model]
  std::array<MapRow, kMaxMapRows> map{};
  std::size_t map_rows = 0;
  std::array<Crosstalk, kMaxCrosstalk> crosstalk{};
  std::size_t crosstalk_rows = 0;

  // Takes from the curves' values what they show of each other; the share of a value that is not
  // valid stays.
  RT_SAFE void remove_crosstalk(std::span<float> value,
                                const std::bitset<kMaxSensors>& valid) const noexcept;

  // Sums the rows of the map. A channel without a row is zero; a channel with an invalid value is
  // not finite, so its joint is not valid.
  RT_SAFE void map_to_hand(std::span<const float> value, const std::bitset<kMaxSensors>& valid,
                           HandAngles& angles) const noexcept;
};

}  // namespace posed::drivers::glove
