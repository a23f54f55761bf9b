// Recordings of a body: its joints' rotation vectors about their mean over all recordings, in the
// canonical humanoid, heading removed (models/motion/README.md, "Pose spaces"). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "models/gesture/vocabulary.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// A group of joints as the questions file has it: VRM bone names.
struct JointGroup {
  std::string name;
  std::vector<std::string> joints;
};

// head, left-arm, legs (with the hips), right-arm and trunk, as far as the skeleton has their
// joints.
[[nodiscard]] std::vector<JointGroup> body_groups(const Skeleton& skeleton);
[[nodiscard]] const std::vector<JointGroup>& body_groups();  // all of them

// Makes a vocabulary of these groups, without labels, whose mean rotations are those of the T-pose.
// Errors: a group without joints, a joint that is no bone or is in two groups, no group with the
// hips.
Result<Vocabulary> body_vocabulary(const std::vector<JointGroup>& groups);

// Reads the clips at `rate_hz`, without segments, and sets the vocabulary's mean rotations to
// theirs. A rest pose that a converter put in front is left out. Errors name the clip: its skeleton
// lacks joints of the vocabulary, it has too few frames, or a channel changes by more than half a
// turn between two frames.
Result<std::vector<Recording>> body_recordings(const std::vector<clip::Clip>& clips, double rate_hz,
                                               Vocabulary& vocabulary);

// Reads one more clip, about the mean rotations that the vocabulary already has.
Result<Recording> body_recording(const clip::Clip& clip, double rate_hz,
                                 const Vocabulary& vocabulary);

}  // namespace posed::gesture
