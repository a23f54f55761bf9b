// A performance on a body: the skeleton, the place and the heading of a clip's first frame, moved
// as a model of bodies performs (models/perform/README.md, "Bodies"). Cold.
#pragma once

#include <memory>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/motion/pose_space.hpp"
#include "models/perform/perform.hpp"
#include "models/perform/standing.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::perform {

// The figure that performs: joints that are not in the model stay as they are in `body`'s first
// frame, and the root moves so that the middle of the feet stays where it is in that frame.
class BodyFigure {
 public:
  // Returns an error for a model of hands, for a body that lacks joints of the model, and for one
  // without a frame.
  static Result<BodyFigure> of(const gesture::GestureModel& model, const clip::Clip& body);

  struct Posed {
    Frame frame;
    double feet_off_m = 0.0;  // how far a foot is from its place in the first frame at most
  };
  [[nodiscard]] Posed pose(const Pose& angles_rad) const;

  // Where the figure looks in the first frame [rad].
  [[nodiscard]] double heading_rad() const { return heading_rad_; }
  [[nodiscard]] const std::shared_ptr<const Skeleton>& skeleton() const { return skeleton_; }

 private:
  BodyFigure(motion::PoseSpace space, std::shared_ptr<const Skeleton> skeleton, const Frame& first);

  std::shared_ptr<const Skeleton> skeleton_;
  motion::PoseSpace space_;
  Standing standing_;
  Frame first_;
  double heading_rad_;
  Standing::Feet places_m_;
  std::vector<float> first_q_;  // the first frame in the model's channels
};

struct BodyPerformance {
  clip::Clip clip;
  double feet_off_m = 0.0;  // farthest that a foot gets from its place in the first frame
};

// The errors are those of BodyFigure::of, and a performance of fewer than two frames is one.
Result<BodyPerformance> perform_on(const gesture::GestureModel& model,
                                   const Performance& performance, const clip::Clip& body);

}  // namespace posed::perform
