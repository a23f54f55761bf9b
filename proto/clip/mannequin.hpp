// A body for a figure without one: a capsule along each bone, so that every program that opens a
// .glb shows something. Cold.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/clip/gltf.hpp"

namespace posed::clip {

// Triangles, outside counterclockwise, in the world of the figure at rest.
struct Mannequin {
  std::vector<float> position_m{}, normal{};  // [vertex x 3]
  std::vector<std::uint16_t> node{};          // [vertex], which alone moves it
  std::vector<std::uint16_t> corner{};        // [triangle x 3], vertices
};

// As many bones as 65,536 vertices serve; a bone has 26. Widths are those of a person where the
// nodes are a person's bones, otherwise a share of the length.
[[nodiscard]] Mannequin mannequin_of(const std::vector<GltfNode>& nodes);

}  // namespace posed::clip
