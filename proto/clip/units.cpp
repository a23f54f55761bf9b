#include "proto/clip/units.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed::clip {
namespace {

constexpr double kHeight_m = 1.7;

struct Unit {
  double metres;
  const char* name;
};
constexpr std::array<Unit, 4> kUnits{{{1.0, "metres"},
                                      {0.01, "centimetres"},
                                      {kCmuUnit_m, "inches / 0.45"},
                                      {0.001, "millimetres"}}};

// Joints that only move the figure through the world: the root, and an only child below it that has
// position channels. Their OFFSET is a location, not a bone length.
std::vector<char> carriers(const Skeleton& skeleton) {
  std::vector<char> carries(skeleton.joints.size(), 0);
  std::vector<int> children(skeleton.joints.size(), 0);
  for (const Joint& joint : skeleton.joints) {
    if (joint.parent >= 0) ++children[joint.parent];
  }
  carries[0] = 1;
  for (const Channel& channel : skeleton.channels) {
    const int parent = skeleton.joints[channel.joint].parent;
    if (channel.translation && parent >= 0 && carries[parent] != 0 && children[parent] == 1) {
      carries[channel.joint] = 1;
    }
  }
  return carries;
}

// The longest path through the figure from leaf to leaf: foot to head or hand to hand. Both are
// about a person's height, however the zero pose is folded.
double longest_way(const Skeleton& skeleton) {
  const std::vector<char> carries = carriers(skeleton);
  std::vector<double> reach(skeleton.joints.size(), 0.0);  // from the joint to its farthest leaf
  double longest = 0.0;
  for (int j = static_cast<int>(skeleton.joints.size()) - 1; j >= 0; --j) {
    const Joint& joint = skeleton.joints[j];
    const double tip = joint.end_site_m ? joint.end_site_m->norm() : 0.0;
    reach[j] = std::max(reach[j], tip);
    if (carries[j] != 0) continue;
    const double way = reach[j] + joint.offset_m.norm();
    longest = std::max(longest, reach[joint.parent] + way);
    reach[joint.parent] = std::max(reach[joint.parent], way);
  }
  return longest;
}

}  // namespace

double guess_unit(const Skeleton& skeleton, std::vector<std::string>& warnings) {
  const double height = longest_way(skeleton);
  if (!(height > 0.0)) return kUnits[1].metres;
  const Unit* best = kUnits.data();
  const auto misfit = [height](const Unit& unit) {
    return std::abs(std::log(height * unit.metres / kHeight_m));
  };
  for (const Unit& unit : kUnits) {
    if (misfit(unit) < misfit(*best)) best = &unit;
  }
  warnings.push_back(std::string("names no unit of length; taken as ") + best->name +
                     " by the figure's height");
  return best->metres;
}

bool is_a_person(const Skeleton& skeleton, double metres_per_unit) {
  const double height_m = longest_way(skeleton) * metres_per_unit;
  return height_m > 0.8 && height_m < 2.6;
}

void scale_lengths(Skeleton& skeleton, double metres_per_unit) {
  for (Joint& joint : skeleton.joints) {
    joint.offset_m *= metres_per_unit;
    if (joint.end_site_m) *joint.end_site_m *= metres_per_unit;
  }
}

}  // namespace posed::clip
