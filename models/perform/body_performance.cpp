#include "models/perform/body_performance.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "models/motion/motion.hpp"
#include "models/motion/pose_space.hpp"
#include "models/perform/standing.hpp"
#include "proto/clip/frames_clip.hpp"

namespace posed::perform {
Result<BodyPerformance> perform_on(const gesture::GestureModel& model,
                                   const Performance& performance, const clip::Clip& body) {
  if (model.is_hand()) return misuse("the model is of hands, which have no body to perform on");
  const auto space = motion::PoseSpace::bind(*model.body, *body.skeleton);
  if (!space) return std::unexpected(space.error());
  if (body.frames() == 0) return fail("has no frame to stand in", body.path);
  const Frame first = body.frame(0);
  const double heading_rad =
      motion::walk_heading_rad({body.skeleton, performance.rate_hz, {first}});
  const Standing standing(*body.skeleton);
  const Standing::Feet places_m = standing.feet_m(first);
  const auto dims = static_cast<std::size_t>(space->dims());
  std::vector<float> q(dims), change(dims);
  std::vector<std::uint8_t> available(dims);
  space->to_vector(first, heading_rad, q, available);
  BodyPerformance out;
  clip::FramesClip frames(body.skeleton);
  std::vector<double> time_s;
  for (const Pose& pose : performance.angles) {
    for (std::size_t d = 0; d < dims; ++d) change[d] = static_cast<float>(pose[d]) - q[d];
    Frame frame = first;
    space->add(frame, heading_rad, q, change);
    out.feet_off_m = std::max(out.feet_off_m, standing.stand(places_m, frame));
    frames.add(frame);
    time_s.push_back(static_cast<double>(time_s.size()) / performance.rate_hz);
  }
  auto clip = frames.finish(body.path, performance.rate_hz, std::move(time_s));
  if (!clip) return std::unexpected(clip.error());
  out.clip = std::move(*clip);
  out.clip.metres_per_unit = body.metres_per_unit;
  return out;
}

}  // namespace posed::perform
