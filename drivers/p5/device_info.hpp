// A P5's greeting: its feature reports as they came, in hexadecimal, so that a log decodes with the
// very rig it was recorded with.
//   p5 hand=right firmware=090403 heads=06.. leds=0c..       a report that is not known: none
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/p5/camera_rig.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::p5 {

struct Greeted {
  Side side = Side::kRight;
  std::vector<std::byte> firmware, heads, leds;  // feature reports 9, 6 and 12; empty: not known

  // Nothing unless both its reports are known.
  [[nodiscard]] std::optional<CameraRig> rig() const;
};

[[nodiscard]] std::string greeting_of(const Greeted& glove);
[[nodiscard]] Result<Greeted> read_greeting(const std::string& text, const std::string& identity);

}  // namespace posed::drivers::p5
