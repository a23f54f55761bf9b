#include "proto/rig/live.hpp"

namespace posed::rig {

Rig recognise(const Skeleton& skeleton) {
  RigInput input;
  for (const Joint& joint : skeleton.joints) {
    input.joints.push_back({.name = joint.name,
                            .parent = joint.parent,
                            .offset = joint.offset_m,
                            .end_site = joint.end_site_m});
  }
  return recognise(input);
}

}  // namespace posed::rig
