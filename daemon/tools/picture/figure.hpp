// FigureShape: what a pose looks like in a picture: a body as sticks with a head, a hand as
// capsules. Left and right limbs, or the five fingers, have colours that colour-blind people can
// tell apart (Okabe and Ito). Cold.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "daemon/tools/picture/camera.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::picture {

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
};

}  // namespace posed::picture
