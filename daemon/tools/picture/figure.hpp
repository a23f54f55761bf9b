// How a pose looks in a picture: FigureShape makes sticks of it, a Camera projects them. Cold.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::picture {

// Camera: how a figure is seen in a picture. It projects without perspective, so that poses beside
// each other have one scale.
enum class View : std::uint8_t {
  kFront,         // the figure looks at the camera; a hand shows its palm
  kSide,          // a walker goes to the right; a hand shows its thumb
  kThreeQuarter,  // between the two and a little from above
};

// "front", "side" or "three-quarter"; anything else is a usage error.
Result<View> view_from_name(std::string_view name);
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

// FigureShape: what a pose looks like in a picture: a body as sticks with a head, a hand as
// capsules, a robot as those that it is kept apart by. Left and right limbs, or the five fingers,
// have colours that colour-blind people can tell apart (Okabe and Ito).
struct Stick {
  Eigen::Vector3d from_m, to_m;  // world
  double width_m;
  std::string_view colour;
};

struct Head {
  Eigen::Vector3d centre_m;  // world
  double radius_m;
};

struct Figure {
  std::vector<Stick> sticks;
  std::optional<Head> head;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();  // world, at height 0 below the root
};

class FigureShape {
 public:
  explicit FigureShape(std::shared_ptr<const Skeleton> skeleton);

  // A joint that was not measured counts as not rotated.
  [[nodiscard]] Figure pose(const Frame& frame) const;

  [[nodiscard]] bool is_hand() const noexcept { return hand_.has_value(); }
  // How the figure stands in the world when it goes towards `heading_rad` (about +Y, 0 is +Z); a
  // hand has no heading.
  [[nodiscard]] Facing facing(double heading_rad) const;
  // A sentence about the colours.
  [[nodiscard]] std::string_view legend() const;

 private:
  // From a joint to its parent, or to a leaf's tip.
  struct Limb {
    int joint;
    bool tip;
    double width_m;
    std::string_view colour;
  };
  void add_limb(int joint, bool tip);

  std::shared_ptr<const Skeleton> skeleton_;
  std::optional<Side> hand_;
  double reach_m_ = 0.0;  // the longest way along the bones from the root to a leaf's tip
  std::vector<Limb> limbs_;
  std::vector<std::string_view> capsule_colours_;  // of the skeleton's capsules
};

}  // namespace posed::picture
