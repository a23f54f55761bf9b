// The angle map: which joints of the hand a glove's calibrated values bend, as a table in
// config/devices/<name>.toml. It holds for both hands: what mirrors a left one is the skeleton.
//
//   [angles]                # calibrated value, its shares in channels of hand45
//   index_mcp = [{channel = "index1_x", gain = -1.0, offset_deg = 0.0}]
//   index_curl = [{channel = "index1_x", gain = 1.57}, {channel = "index2_x", gain = 1.75}]
//
// channel: finger, joint 1 to 3 from the palm outwards, x flexion, y spread, z twist. gain: radians
// a unit of the value, 1 when left out; offset_deg: 0 when left out. Shares of one channel add up;
// a channel that nothing names stays at zero. Other tables of the file are not looked at.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/glove/calibration.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// The text of config/devices/<name>.toml, as it was built in. Cold.
[[nodiscard]] Result<std::string> device_table(std::string_view name);

// Errors name `file` and line: unknown value or channel, no number. Cold.
[[nodiscard]] Result<std::vector<MapRow>> parse_angle_map(const std::string& toml,
                                                          const std::string& file,
                                                          const std::vector<Sensor>& sensors);

// "index1_x" to its place in HandAngles; -1 when there is no such channel. Cold.
[[nodiscard]] int hand_channel(std::string_view name);

}  // namespace posed::drivers::glove
