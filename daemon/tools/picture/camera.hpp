// Camera: how a figure is seen in a picture. It projects without perspective, so that poses beside
// each other have one scale. Cold.
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "proto/frame/result.hpp"

namespace posed::picture {

enum class View : std::uint8_t {
  kFront,         // the figure looks at the camera; a hand shows its palm
  kSide,          // a walker goes to the right; a hand shows its thumb
  kThreeQuarter,  // between the two and a little from above
};

// "front", "side" or "three-quarter"; anything else is a usage error.
[[nodiscard]] Result<View> view_from_name(std::string_view name);
[[nodiscard]] std::string_view view_words(View view);  // "from the side", for a caption

// Unit vectors of a figure, in the world.
struct Facing {
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  // where it looks; a hand's palm
  Eigen::Vector3d side = -Eigen::Vector3d::UnitX();    // from where a side view looks at it
};

// A point in the picture's directions.
struct Seen {
  double right_m = 0.0, up_m = 0.0;
  double near_m = 0.0;  // larger: nearer to the camera
};

class Camera {
 public:
  Camera(View view, const Facing& facing);

  [[nodiscard]] Seen see(const Eigen::Vector3d& world_m) const {
    return {.right_m = right_.dot(world_m), .up_m = up_.dot(world_m), .near_m = near_.dot(world_m)};
  }

 private:
  Eigen::Vector3d right_, up_, near_;
};

}  // namespace posed::picture
