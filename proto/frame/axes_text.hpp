// A rotation that maps axes to axes, as skeleton profiles and logs of posed 0.1 write it. Cold.
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Geometry>

namespace posed {

// "+y-x+z" says where x, y and z go. Empty for text that is not such a rotation.
[[nodiscard]] std::optional<Eigen::Quaterniond> axes_from_text(std::string_view text);

}  // namespace posed
