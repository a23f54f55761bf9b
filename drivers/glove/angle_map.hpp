// The angle map: a table in config/devices/<name>.toml that states which joints of the hand follow
// a glove's calibrated values. It is the same for both hands; the skeleton mirrors a left one.
//
//   [angles]                # calibrated value, its shares in channels of hand45
//   index_mcp = [{channel = "index1_x", gain = -1.0, offset_deg = 0.0}]
//   index_curl = [{channel = "index1_x", gain = 1.57}, {channel = "index2_x", gain = 1.75}]
//
// channel: finger, joint 1 to 3 from the palm outwards, x flexion, y spread, z twist. gain: radians
// per unit of the value, default 1; offset_deg: default 0. Several entries for one channel add up;
// a channel without an entry stays at zero. Other tables of the file are ignored.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/glove/calibration.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// Gives the model the map in config/devices/<name>.toml, as built into posed. Cold.
Result<Model> with_device_table(Model model, std::string_view name);

// Errors name `file` and line: unknown value or channel, invalid number. Cold.
Result<std::vector<MapRow>> parse_angle_map(const std::string& toml, const std::string& file,
                                            const std::vector<Sensor>& sensors);

// Turns "index1_x" into its index in HandAngles; -1 when there is no such channel. Cold.
[[nodiscard]] int hand_channel(std::string_view name);

}  // namespace posed::drivers::glove
