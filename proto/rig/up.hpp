// Which axis of a file points up, and which one a figure's zero pose faces. Cold.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "proto/rig/directions.hpp"

namespace posed {

enum class UpAxis : std::uint8_t { kPlusY, kPlusZ, kMinusY, kMinusZ, kPlusX };
inline constexpr std::array kUpAxes{UpAxis::kPlusY, UpAxis::kPlusZ, UpAxis::kMinusY,
                                    UpAxis::kMinusZ, UpAxis::kPlusX};

// "+y", "+z", "-y", "-z", "+x".
[[nodiscard]] std::string_view up_text(UpAxis up);
[[nodiscard]] std::optional<UpAxis> up_from_text(std::string_view text);

// "+x", "-x", "+y", "-y", "+z", "-z": a unit vector along an axis of the file.
[[nodiscard]] std::optional<Eigen::Vector3d> axis_from_text(std::string_view text);
// The axis nearest to `direction`.
[[nodiscard]] std::string_view axis_text(const Eigen::Vector3d& direction);

// The rotation from the file's axes to posed's, which maps axes to axes: identity for +y.
[[nodiscard]] Eigen::Matrix3d up_turn(UpAxis up);

}  // namespace posed
