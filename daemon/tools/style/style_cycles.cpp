#include "daemon/tools/style/style_cycles.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/degrees.hpp"
#include "daemon/tools/report/style_sections.hpp"
#include "models/motion/motion.hpp"
#include "models/motion/symmetric_eigen.hpp"
#include "models/style/train/difference_process.hpp"
#include "models/style/train/harmonics.hpp"

namespace posed::tools {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kPosesShown = 8;

report::PosePaths::Path path_of(std::string name, const MatrixXd& points_rad) {
  report::PosePaths::Path path{std::move(name), {}};
  for (Eigen::Index i = 0; i < points_rad.rows(); ++i) {
    path.points.push_back({kDegrees * points_rad(i, 0), kDegrees * points_rad(i, 1)});
  }
  return path;
}

}  // namespace

std::string StyleCycles::what() const {
  return fmt::format("{}{}\"{}\" to \"{}\"", motion, motion.empty() ? "" : ", ", source_name,
                     target_name);
}

MatrixXd cycle_points(const MatrixXd& coefficients) {
  return style::harmonic_basis(style::cycle_phases(kReportPhases), style::kCycleHarmonics) *
         coefficients;
}

Plane plane_of(const MatrixXd& rows) {
  Plane plane;
  plane.middle = rows.colwise().mean();
  plane.directions = MatrixXd::Zero(rows.cols(), 2);
  const MatrixXd centred = rows.rowwise() - plane.middle;
  // The smaller of the two products has the same values that are not zero.
  const bool wide = centred.cols() > centred.rows();
  const auto eigen = motion::symmetric_eigen(wide ? MatrixXd(centred * centred.transpose())
                                                  : MatrixXd(centred.transpose() * centred));
  const double sum = eigen.values.sum();
  const Eigen::Index last = eigen.values.size() - 1;
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(2, last + 1); ++k) {
    const VectorXd found = eigen.vectors.col(last - k);
    const VectorXd direction = wide ? VectorXd(centred.transpose() * found) : found;
    if (!(direction.norm() > 0.0) || !(sum > 0.0)) continue;
    plane.directions.col(k) = direction.normalized();
    (k == 0 ? plane.first_share : plane.second_share) = eigen.values[last - k] / sum;
  }
  return plane;
}

CycleFigures::CycleFigures(motion::PoseSpaceSpec spec, motion::PoseSpace space, const Frame& base,
                           std::shared_ptr<const Skeleton> skeleton)
    : spec_(std::move(spec)), space_(std::move(space)), base_(base), shape_(std::move(skeleton)) {}

Result<CycleFigures> CycleFigures::make(const clip::Clip& clip, const motion::PoseSpaceSpec& spec) {
  auto motion = motion::motion_of(clip);
  if (!motion) return std::unexpected(motion.error());
  if (motion::begins_with_added_pose(*motion)) motion::drop_first_frame(*motion);
  auto space = motion::PoseSpace::bind(spec, *motion->skeleton);
  if (!space) return std::unexpected(space.error());
  Frame base = motion->frames[motion->frames.size() / 2];
  double height_m = 0.0;
  for (const Frame& frame : motion->frames) {
    height_m += static_cast<double>(frame.root_position_m[1]) / motion->size();
  }
  base.root_position_m = {0.0F, static_cast<float>(height_m), 0.0F};
  return CycleFigures(spec, std::move(*space), base, motion->skeleton);
}

picture::Figure CycleFigures::pose(const VectorXd& q) const {
  const auto dims = static_cast<std::size_t>(space_.dims());
  std::vector<float> now(dims);
  std::vector<float> change(dims);
  std::vector<std::uint8_t> available(dims);
  Frame frame = base_;
  space_.to_vector(frame, 0.0, now, available);
  for (std::size_t d = 0; d < dims; ++d) {
    change[d] = static_cast<float>(q[static_cast<Eigen::Index>(d)]) - now[d];
  }
  space_.add(frame, 0.0, now, change);
  return shape_.pose(frame);
}

report::Figure CycleFigures::poses(const StyleCycles& cycles) const {
  report::CycleRows rows;
  rows.title = "Mean cycles side by side: " + cycles.what();
  rows.sentence = fmt::format(
      "One stride at eight phases: how the second row differs from the first is what the model "
      "adds, how it differs from the third is what it misses. Phase 0 is the right thigh farthest "
      "in front; {}, and the ground is marked each 0.5 m.",
      shape_.legend());
  const std::pair<std::string, const MatrixXd*> all[]{
      {cycles.source_name + ", the mean of its cycles", &cycles.source},
      {"styled", &cycles.styled},
      {cycles.target_name + ", what it should become", &cycles.target}};
  for (const auto& [title, points] : all) {
    picture::StripRow row{.title = title, .poses = {}};
    for (int i = 0; i < kPosesShown; ++i) {
      row.poses.push_back({.figure = pose(points->row(i * kReportPhases / kPosesShown).transpose()),
                           .caption = fmt::format("{}°", i * 360 / kPosesShown)});
    }
    rows.rows.push_back(std::move(row));
  }
  for (const auto view : {picture::View::kFront, picture::View::kSide}) {
    rows.views.push_back({.camera = picture::Camera(view, shape_.facing(0.0)),
                          .from = std::string(picture::view_words(view))});
  }
  return report::cycle_strips(rows);
}

report::Figure CycleFigures::paths(const StyleCycles& cycles) const {
  const Plane plane = plane_of(cycles.source);
  return report::pose_paths(
      {.what = cycles.what(),
       .input = path_of("input: " + cycles.source_name, plane.of(cycles.source)),
       .output = path_of("output: styled", plane.of(cycles.styled)),
       .goal = path_of("target: " + cycles.target_name, plane.of(cycles.target)),
       .first_share = plane.first_share,
       .second_share = plane.second_share});
}

report::Figure CycleFigures::residuals(const StyleCycles& cycles) const {
  std::vector<report::JointResidual> joints;
  joints.reserve(spec_.joints.size());
  for (const std::string& name : spec_.joints) joints.push_back({name, 0.0, 0.0});
  for (int d = 0; d < space_.dims(); ++d) {
    report::JointResidual& joint = joints[static_cast<std::size_t>(space_.joint_of_dim(d))];
    joint.before_deg += (cycles.source.col(d) - cycles.target.col(d)).squaredNorm();
    joint.after_deg += (cycles.styled.col(d) - cycles.target.col(d)).squaredNorm();
  }
  for (report::JointResidual& joint : joints) {
    joint.before_deg = kDegrees * std::sqrt(joint.before_deg / kReportPhases);
    joint.after_deg = kDegrees * std::sqrt(joint.after_deg / kReportPhases);
  }
  return report::joint_residuals(cycles.what(), joints);
}

}  // namespace posed::tools
