// The formats that proto/clip reads or writes itself; private to it. Each is defined in the .cpp
// that reads or writes it.
#pragma once

#include "proto/clip/format.hpp"

namespace posed::clip {

[[nodiscard]] Format bvh_format();
[[nodiscard]] Format amc_format();
[[nodiscard]] Format hand_csv_format();
[[nodiscard]] Format glb_format();
[[nodiscard]] Format gltf_format();

}  // namespace posed::clip
