// The figures of Axis Neuron and Axis Studio: 59 bones in the order in which every stream and BVH
// of theirs lists them, and the proportions that posed assumes when a stream does not carry them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/frame/frame.hpp"

namespace posed::drivers::axis {

inline constexpr std::size_t kBones = 59;
inline constexpr std::size_t kHips = 0;
inline constexpr double kCentimetre_m = 0.01;

// Bones 10 and 11 are the top of the trunk and the neck in Axis Neuron, which hangs the shoulders
// on bone 10, and the two halves of the neck in Axis Studio, which hangs them on bone 9. The
// streams do not say which it is.
enum class Figure : std::uint8_t { kPro, kStudio };
inline constexpr std::array<std::string_view, 2> kFigureNames{"pro", "studio"};

// Offsets [cm] of the bones from their parents while the figure stands in T-pose; those of the hips
// are their height.
using Proportions = std::array<Vec3f, kBones>;

// "RightHandThumb1" as the vendor spells it. Cold.
[[nodiscard]] std::string bone_name(std::size_t bone, Figure figure);

// An earlier bone; -1 for the hips.
[[nodiscard]] int bone_parent(std::size_t bone, Figure figure) noexcept;

// Returns the end [cm] of a bone without children in its own frame; zero for other bones. Streams
// never carry it.
RT_SAFE [[nodiscard]] Vec3f bone_end_cm(std::size_t bone) noexcept;

// A person of 1.73 m.
RT_SAFE [[nodiscard]] const Proportions& default_proportions(Figure figure = Figure::kPro) noexcept;

// The figure that has these measured offsets: a whole neck is longer than a part of the trunk.
[[nodiscard]] Figure figure_with(const Proportions& offset_cm) noexcept;

// The offset of a bone from the displacement that a stream carries for it. The applications shift
// bones a little (up to 4 cm at the feet) so that feet and hands stay where they touch something,
// although bones have no joints that could slide. A bone that points along an axis in T-pose
// therefore keeps its direction and takes only its length from the stream.
RT_SAFE [[nodiscard]] Vec3f offset_from(std::size_t bone, const Vec3f& displacement_cm) noexcept;

}  // namespace posed::drivers::axis
