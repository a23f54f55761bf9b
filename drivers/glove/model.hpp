// What a glove is before anybody wore it: its sensors, how they are read without a calibration, and
// which joints they bend. A driver states it; calibrations are checked and compiled against it.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/glove/calibration.hpp"

namespace posed::drivers::glove {

struct Sensor {
  std::string name;      // "index_mcp"; also the name of its calibrated value in the Sample
  double raw_min = 0.0;  // what the device can send
  double raw_max = 255.0;
  Curve curve;               // raw to calibrated value by default
  std::string unit = "rad";  // of the calibrated value; "1" for a share of the finger's way
  double map_sign = 1.0;     // -1 where this hand's value runs against the map: its gain is turned
};

struct Model {
  std::string driver;           // registry name; a calibration for another one is refused
  std::vector<Sensor> sensors;  // in the order of the decoder's raw values
  // The device's own constants that a calibration may set, with their defaults.
  std::vector<std::pair<std::string, double>> parameters{};
  std::string map_toml{};  // config/devices/<name>.toml: calibrated values to hand45
  // The device's formula the other way: values as the map has them to what the curves give, in
  // place. Null: the same.
  void (*uncompute)(std::span<double> value) = nullptr;
};

}  // namespace posed::drivers::glove
