// HandShape: lengths and thicknesses of a hand's bones and ranges of its joints. Read from
// config/hands/*.toml, which is built into the binary. It is always the right hand, palm down,
// fingers along +Z, thumb at +X, in the wrist's frame; hand_skeleton() and models/hand mirror it
// for a left hand. Cold.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed {

struct AngleRange {
  double min_rad = 0.0;
  double max_rad = 0.0;
};

struct FingerShape {
  Eigen::Vector3d base_m = Eigen::Vector3d::Zero();  // position of its first joint
  // Orientation of the straight finger: its bones point along frame * Z and its channels turn in
  // `frame`. Identity for all fingers except the thumb.
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();
  // In which the first joint's channels turn, `frame` unless the file says otherwise. A thumb's
  // first joint twists about an axis that lies askew to the bone, so that the whole ray swings
  // around it: that is how a thumb comes to face the fingers.
  Eigen::Quaterniond root = Eigen::Quaterniond::Identity();
  std::array<double, kFingerJoints> length_m{};
  std::array<double, kFingerJoints> radius_m{};                  // of the capsule around each bone
  std::array<std::array<AngleRange, 3>, kFingerJoints> range{};  // [joint][x, y, z]
};

struct HandShape {
  std::string name;
  std::array<FingerShape, kFingers> fingers;
};

// `text` is TOML; `file` is used in error messages, which name the line.
Result<HandShape> parse_hand_shape(std::string_view text, const std::string& file);

// All built-in shapes, and the one called `name`; an unknown name is an error that lists them.
[[nodiscard]] std::span<const HandShape> hand_shapes();
Result<const HandShape*> find_hand_shape(const std::string& name);

inline constexpr std::string_view kDefaultHandShape = "adult";
[[nodiscard]] const HandShape& default_hand_shape();

}  // namespace posed
