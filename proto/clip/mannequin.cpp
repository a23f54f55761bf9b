#include "proto/clip/mannequin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

namespace posed::clip {
namespace {

constexpr int kSides = 6;
// Rings from the begin of a bone to its end: how far they are along the half spheres, and wide.
constexpr std::array<std::pair<double, double>, 4> kRings{
    {{-0.7071, 0.7071}, {0.0, 1.0}, {0.0, 1.0}, {0.7071, 0.7071}}};
constexpr int kVertices = static_cast<int>(kRings.size()) * kSides + 2;
constexpr double kMinLength_m = 1e-3;

// A bone's radius is this share of its length, and at most so wide.
struct Width {
  double share, most_m;
};

Width width_of(std::optional<Bone> bone, std::optional<Bone> next) {
  using enum Bone;
  if (!bone) return {.share = 0.12, .most_m = 0.04};
  if (*bone <= kUpperChest && (!next || *next <= kNeck)) return {.share = 0.8, .most_m = 0.11};
  switch (*bone) {
    case kNeck:
      return {.share = 0.5, .most_m = 0.05};
    case kHead:
      return {.share = 0.45, .most_m = 0.09};
    case kLeftUpperLeg:
    case kRightUpperLeg:
      return {.share = 0.18, .most_m = 0.075};
    case kLeftLowerLeg:
    case kRightLowerLeg:
    case kLeftUpperArm:
    case kRightUpperArm:
      return {.share = 0.15, .most_m = 0.055};
    default:  // fingers are short enough to be thin
      return {.share = *bone < kLeftThumbMetacarpal ? 0.2 : 0.3, .most_m = 0.04};
  }
}

void add_vertex(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, int node,
                Mannequin& body) {
  for (int i = 0; i < 3; ++i) {
    body.position_m.push_back(static_cast<float>(at[i]));
    body.normal.push_back(static_cast<float>(normal[i]));
  }
  body.node.push_back(static_cast<std::uint16_t>(node));
}

void add_triangles(std::size_t first, Mannequin& body) {
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t corner : {a, b, c}) {
      body.corner.push_back(static_cast<std::uint16_t>(first + corner));
    }
  };
  const auto at = [](std::size_t ring, std::size_t side) {
    return 1 + ring * kSides + side % kSides;
  };
  constexpr std::size_t kLast = kVertices - 1;
  for (std::size_t side = 0; side < kSides; ++side) {
    add(0, at(0, side + 1), at(0, side));
    for (std::size_t ring = 0; ring + 1 < kRings.size(); ++ring) {
      add(at(ring, side), at(ring, side + 1), at(ring + 1, side));
      add(at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side));
    }
    add(kLast, at(kRings.size() - 1, side), at(kRings.size() - 1, side + 1));
  }
}

void add_capsule(const Eigen::Vector3d& begin, const Eigen::Vector3d& end, double radius_m,
                 int node, Mannequin& body) {
  const std::size_t first = body.node.size();
  const Eigen::Vector3d along = (end - begin).normalized();
  const Eigen::Vector3d side = along.unitOrthogonal(), other = along.cross(side);
  add_vertex(begin - radius_m * along, -along, node, body);
  for (std::size_t ring = 0; ring < kRings.size(); ++ring) {
    const auto& [forth, wide] = kRings[ring];
    const Eigen::Vector3d& centre = ring < kRings.size() / 2 ? begin : end;
    for (int s = 0; s < kSides; ++s) {
      const double turn = 2.0 * std::numbers::pi * s / kSides;
      const Eigen::Vector3d normal =
          forth * along + wide * (std::cos(turn) * side + std::sin(turn) * other);
      add_vertex(centre + radius_m * normal, normal, node, body);
    }
  }
  add_vertex(end + radius_m * along, along, node, body);
  add_triangles(first, body);
}

}  // namespace

Mannequin mannequin_of(const std::vector<GltfNode>& nodes) {
  Mannequin body;
  std::vector<Eigen::Vector3d> place_m;  // in the world, at rest
  for (const GltfNode& node : nodes) {
    place_m.push_back(node.offset_m);
    if (node.parent < 0) continue;
    const auto parent = static_cast<std::size_t>(node.parent);
    place_m.back() += place_m[parent];
    const double length_m = node.offset_m.norm();
    constexpr std::size_t kMaxVertices = std::numeric_limits<std::uint16_t>::max();
    if (length_m < kMinLength_m || body.node.size() + kVertices > kMaxVertices) continue;
    const Width width = width_of(nodes[parent].bone, node.bone);
    add_capsule(place_m[parent], place_m.back(), std::min(width.share * length_m, width.most_m),
                node.parent, body);
  }
  return body;
}

}  // namespace posed::clip
