#include "models/style/judge/evaluate.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "models/feet/foot_score.hpp"
#include "models/motion/motion.hpp"
#include "models/style/model/harmonics.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNothing_rad = 1e-6;  // differences below this are rounding of float poses

double rms(const MatrixXd& m) {
  return std::sqrt(m.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, m.size())));
}

// A clip as rotation vectors of its joints, and their phases.
struct View {
  MatrixXd q;
  VectorXd phase;
  double period_s = 0.0;

  [[nodiscard]] MatrixXd coefficients() const { return fit_harmonics(phase, q, kCycleHarmonics); }
};

Result<View> view_of(const motion::Motion& motion, const motion::PoseSpaceSpec& spec,
                     const std::string& path) {
  const auto space = motion::PoseSpace::bind(spec, *motion.skeleton);
  if (!space) {
    return fail("this clip cannot be compared in the model's pose space, " +
                    std::string(motion::space_name(spec.space)) + ": " + space.error().message,
                path);
  }
  const auto leg = motion::leg_signal(motion);
  if (!leg) return fail("the skeleton names no upper legs to find the stride by", path);
  if (!has_stride(motion.size(), motion.rate_hz)) {
    return fail("the clip is too short for one stride (0.6 s)", path);
  }
  const Stride stride = find_stride(*leg, motion.rate_hz);
  View view;
  const MatrixXd all = motion::pose_vectors(motion, *space, motion::walk_heading_rad(motion));
  std::vector<int> dims;  // those that do not belong to the root
  for (int d = 0; d < space->dims(); ++d) {
    if (space->joint_of_dim(d) != spec.root) dims.push_back(d);
  }
  view.q = all(Eigen::all, dims);
  view.phase = clip_phase(stride.theta0, stride.dtheta, motion.size());
  view.period_s = 2.0 * std::numbers::pi / stride.dtheta / motion.rate_hz;
  return view;
}

// The space to compare in, about the target's mean pose.
Result<motion::PoseSpaceSpec> space_about(const motion::PoseSpaceSpec& model_space,
                                          const motion::Motion& target) {
  motion::PoseSpaceSpec spec = model_space;
  if (spec.space == motion::Space::kNative) {
    spec = TRY(motion::describe_space(spec.space, *target.skeleton));
  }
  const motion::Motion* of_target[] = {&target};
  TRY(motion::set_mean_rotations(of_target, spec));
  return spec;
}

double jerk(const MatrixXd& q) {
  const auto rows = q.rows() - 3;
  if (rows < 1) return 0.0;
  return rms(q.bottomRows(rows) - 3.0 * q.middleRows(2, rows) + 3.0 * q.middleRows(1, rows) -
             q.topRows(rows));
}

}  // namespace

Result<StyleScore> evaluate_style(const clip::Clip& source, const clip::Clip& styled,
                                  const clip::Clip& target, const motion::PoseSpaceSpec& space) {
  auto target_motion = TRY(motion::performed_motion_of(target));
  const auto spec = space_about(space, target_motion);
  if (!spec) return fail(spec.error().message, target.path);
  const auto goal = TRY(view_of(target_motion, *spec, target.path));
  auto source_motion = TRY(motion::motion_of(source));
  auto styled_motion = TRY(motion::motion_of(styled));
  if (motion::begins_with_added_pose(source_motion)) {  // then the styled copy does, too
    motion::drop_first_frame(source_motion);
    motion::drop_first_frame(styled_motion);
  }
  const auto before = TRY(view_of(source_motion, *spec, source.path));
  const auto after = TRY(view_of(styled_motion, *spec, styled.path));

  const MatrixXd grid = grid_basis();
  const MatrixXd goal_coefficients = goal.coefficients();
  const MatrixXd goal_cycle = grid * goal_coefficients;
  const auto at = [&](const View& view) {
    return MatrixXd(harmonic_basis(view.phase, kCycleHarmonics) * goal_coefficients);
  };
  StyleScore score;
  const double apart = rms(grid * before.coefficients() - goal_cycle);
  const double source_jerk = jerk(before.q);
  if (!(source_jerk > 0.0)) {
    return fail("the source does not move; give a clip of a walk", source.path);
  }
  if (apart < kNothing_rad) {
    return fail(
        "the target walks as the source does already, so nothing can be measured; "
        "give a target in another style",
        target.path);
  }
  score.cycle_ratio = rms(grid * after.coefficients() - goal_cycle) / apart;
  score.ratio = rms(after.q - at(after)) / rms(before.q - at(before));
  score.jerk_ratio = jerk(after.q) / source_jerk;
  score.component_rms_deg = rms(after.q - before.q) / kDegree;
  score.source_component_rms_deg = apart / kDegree;
  score.source_period_s = before.period_s;
  score.target_period_s = goal.period_s;
  score.slide_m_s = {.source = feet::slide_m_s(source_motion, source_motion),
                     .styled = feet::slide_m_s(source_motion, styled_motion),
                     .target = feet::slide_m_s(target_motion, target_motion)};
  score.root_speed_m_s = {.source = feet::root_speed_m_s(source_motion, before.period_s),
                          .styled = feet::root_speed_m_s(styled_motion, before.period_s),
                          .target = feet::root_speed_m_s(target_motion, goal.period_s)};
  score.sink_m = feet::sink_m(source_motion, styled_motion);
  score.body = body_errors(source_motion, styled_motion, target_motion);
  return score;
}

}  // namespace posed::style
