// The description of a type of glove before it is calibrated: its sensors, their default curves,
// and the joints that they move. A driver provides it; calibrations are checked and compiled
// against it.
#pragma once

#include <bitset>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/glove/calibration.hpp"

namespace posed::drivers::glove {

struct Sensor {
  std::string name;      // "index_mcp"; also the name of its calibrated value in the Sample
  double raw_min = 0.0;  // range of the values that the device can send
  double raw_max = 255.0;
  Curve curve;               // default curve from raw to calibrated value
  std::string unit = "rad";  // of the calibrated value; "1" for a share of the finger's range
  // -1 when this hand's value runs opposite to the map: its gain changes sign.
  double map_sign = 1.0;
};

struct Model {
  std::string driver;           // registry name; a calibration for another driver is an error
  std::vector<Sensor> sensors;  // in the order of the decoder's raw values
  // The device's own constants that a calibration may set, with their defaults.
  std::vector<std::pair<std::string, double>> parameters{};
  std::string map_toml{};  // config/devices/<name>.toml: calibrated values to hand45
  // The device's own formula, in place: from the values of the curves to the values in the map; and
  // its inverse. Null: they are the same.
  void (*compute)(const Calibration& calibration, std::span<float> value,
                  std::bitset<kMaxSensors>& valid) = nullptr;
  void (*uncompute)(std::span<double> value) = nullptr;
};

}  // namespace posed::drivers::glove
