#include "models/perform/body_performance.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "models/motion/motion.hpp"
#include "proto/clip/frames_clip.hpp"

namespace posed::perform {

Result<BodyFigure> BodyFigure::of(const gesture::GestureModel& model, const clip::Clip& body) {
  if (model.is_hand()) return misuse("the model is of hands, which have no body to perform on");
  auto space = TRY(motion::PoseSpace::bind(*model.body, *body.skeleton));
  if (body.frames() == 0) return fail("has no frame to stand in", body.path);
  return BodyFigure(std::move(space), body.skeleton, body.frame(0));
}

BodyFigure::BodyFigure(motion::PoseSpace space, std::shared_ptr<const Skeleton> skeleton,
                       const Frame& first)
    : skeleton_(std::move(skeleton)),
      space_(std::move(space)),
      standing_(*skeleton_),
      first_(first),
      heading_rad_(motion::walk_heading_rad({skeleton_, 0.0, {first}})),
      places_m_(standing_.feet_m(first)),
      first_q_(space_.dims()) {
  std::vector<std::uint8_t> available(first_q_.size());
  space_.to_vector(first_, heading_rad_, first_q_, available);
}

BodyFigure::Posed BodyFigure::pose(const Pose& angles_rad) const {
  std::vector<float> change(first_q_.size());
  for (std::size_t d = 0; d < change.size(); ++d) {
    change[d] = static_cast<float>(angles_rad[d]) - first_q_[d];
  }
  Posed posed{.frame = first_};
  space_.add(posed.frame, heading_rad_, first_q_, change);
  posed.feet_off_m = standing_.stand(places_m_, posed.frame);
  return posed;
}

Result<BodyPerformance> perform_on(const gesture::GestureModel& model,
                                   const Performance& performance, const clip::Clip& body) {
  const auto figure = TRY(BodyFigure::of(model, body));
  BodyPerformance out;
  clip::FramesClip frames(body.skeleton);
  std::vector<double> time_s;
  for (const Pose& pose : performance.angles) {
    const BodyFigure::Posed posed = figure.pose(pose);
    out.feet_off_m = std::max(out.feet_off_m, posed.feet_off_m);
    frames.add(posed.frame);
    time_s.push_back(static_cast<double>(time_s.size()) / performance.rate_hz);
  }
  auto clip = TRY(frames.finish(body.path, performance.rate_hz, std::move(time_s)));
  out.clip = std::move(clip);
  out.clip.metres_per_unit = body.metres_per_unit;
  return out;
}

}  // namespace posed::perform
