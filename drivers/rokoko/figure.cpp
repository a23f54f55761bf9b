// The emulated person: where the joints lie in T-pose.
#include "drivers/rokoko/emulator.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::rokoko {
namespace {

struct Place {
  std::string_view joint;  // without "left": the right side is its mirror image
  Vec3f from_parent_m;     // in T-pose, in posed's axes
};

constexpr std::array<Place, 34> kPlaces{{{"hip", {0.0F, 0.0F, 0.0F}},
                                         {"spine", {0.0F, 0.1F, 0.0F}},
                                         {"chest", {0.0F, 0.2F, 0.0F}},
                                         {"neck", {0.0F, 0.24F, 0.0F}},
                                         {"head", {0.0F, 0.1F, 0.02F}},
                                         {"Shoulder", {0.04F, 0.18F, 0.0F}},
                                         {"UpperArm", {0.14F, 0.0F, 0.0F}},
                                         {"LowerArm", {0.28F, 0.0F, 0.0F}},
                                         {"Hand", {0.26F, 0.0F, 0.0F}},
                                         {"ThumbProximal", {0.025F, -0.01F, 0.025F}},
                                         {"ThumbMedial", {0.032F, 0.0F, 0.032F}},
                                         {"ThumbDistal", {0.023F, 0.0F, 0.023F}},
                                         {"ThumbTip", {0.018F, 0.0F, 0.018F}},
                                         {"IndexProximal", {0.09F, 0.0F, 0.027F}},
                                         {"IndexMedial", {0.042F, 0.0F, 0.0F}},
                                         {"IndexDistal", {0.025F, 0.0F, 0.0F}},
                                         {"IndexTip", {0.02F, 0.0F, 0.0F}},
                                         {"MiddleProximal", {0.093F, 0.0F, 0.004F}},
                                         {"MiddleMedial", {0.046F, 0.0F, 0.0F}},
                                         {"MiddleDistal", {0.028F, 0.0F, 0.0F}},
                                         {"MiddleTip", {0.022F, 0.0F, 0.0F}},
                                         {"RingProximal", {0.088F, 0.0F, -0.017F}},
                                         {"RingMedial", {0.042F, 0.0F, 0.0F}},
                                         {"RingDistal", {0.026F, 0.0F, 0.0F}},
                                         {"RingTip", {0.021F, 0.0F, 0.0F}},
                                         {"LittleProximal", {0.081F, 0.0F, -0.036F}},
                                         {"LittleMedial", {0.033F, 0.0F, 0.0F}},
                                         {"LittleDistal", {0.02F, 0.0F, 0.0F}},
                                         {"LittleTip", {0.019F, 0.0F, 0.0F}},
                                         {"UpLeg", {0.09F, -0.06F, 0.0F}},
                                         {"Leg", {0.0F, -0.42F, 0.0F}},
                                         {"Foot", {0.0F, -0.41F, 0.0F}},
                                         {"Toe", {0.0F, -0.06F, 0.13F}},
                                         {"ToeEnd", {0.0F, 0.0F, 0.07F}}}};

Eigen::Vector3f from_parent_m(std::string_view joint) {
  const bool right = joint.starts_with("right");
  if (right) joint.remove_prefix(5);
  if (joint.starts_with("left")) joint.remove_prefix(4);
  for (const Place& place : kPlaces) {
    if (place.joint != joint) continue;
    const Vec3f& offset_m = right ? mirrored(place.from_parent_m) : place.from_parent_m;
    return {offset_m[0], offset_m[1], offset_m[2]};
  }
  return Eigen::Vector3f::Zero();
}

}  // namespace

DescribedBody emulated_person(std::string_view name, const JointSet& joints) {
  DescribedBody body;
  body.key.name.keep(name);
  body.joints = joints;
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    const int parent = studio_joint(j).parent;
    if (!joints[j] || parent < 0) continue;
    const Eigen::Quaternionf T_parent = to_eigen(t_pose_rotation(static_cast<std::size_t>(parent)));
    const Eigen::Vector3f offset_m = T_parent.conjugate() * from_parent_m(studio_joint(j).name);
    body.offset_m[j] = {offset_m.x(), offset_m.y(), offset_m.z()};
  }
  return body;
}

}  // namespace posed::drivers::rokoko
