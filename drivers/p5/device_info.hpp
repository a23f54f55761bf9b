// The device info of a P5: its feature reports as received, in hexadecimal, so that a log is
// decoded with the same rig geometry with which it was recorded. A missing report is written as
// none.
//   p5 hand=right firmware=090403 heads=06.. leds=0c..
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/p5/camera_rig.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::p5 {

struct GloveSettings {
  Side side = Side::kRight;
  std::vector<std::byte> firmware, heads, leds;  // feature reports 9, 6 and 12; empty: not known

  // Empty unless both of its reports are known.
  [[nodiscard]] std::optional<CameraRig> rig() const;
};

[[nodiscard]] std::string device_info_of(const GloveSettings& glove);
[[nodiscard]] Result<GloveSettings> read_device_info(const std::string& text,
                                                     const std::string& identity);

}  // namespace posed::drivers::p5
