// FramesClip: a clip made of published frames, one after the other. A frame carries rotations, the
// angles of its channels and where its root joint is; the other position channels of the skeleton
// stand at its offsets.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/frame/frame.hpp"

namespace posed::clip {

class FramesClip {
 public:
  explicit FramesClip(std::shared_ptr<const Skeleton> skeleton);

  // A frame of the skeleton. A channel without a value is NaN.
  void add(const Frame& frame);

  // `time_s` of every frame, increasing. At `rate_hz`; 0: one over the median step. An error with
  // fewer than two frames.
  [[nodiscard]] Result<Clip> finish(const std::string& path, double rate_hz,
                                    std::vector<double> time_s) const;

 private:
  void add_angles(const Frame& frame);
  void add_root_position(const Frame& frame);

  std::shared_ptr<const Skeleton> skeleton_;
  bool exact_;               // the channels are the source's own
  int moving_;               // the joint, root_joint or above, whose position channels are written
  std::vector<double> row_;  // [channel]
  std::vector<double> values_;
};

// Lets every channel without a value hold the one before, the first one its first; says in
// `warnings` how many. For formats that cannot leave a gap.
void hold_missing(Clip& clip);

}  // namespace posed::clip
