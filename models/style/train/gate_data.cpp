#include "models/style/train/gate_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string_view>
#include <tuple>
#include <vector>

#include <Eigen/Cholesky>

#include "models/style/live/live_motion.hpp"
#include "models/style/train/target_training.hpp"
#include "models/style/train/training_check.hpp"
#include "models/style/train/training_pairs.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Groups of these names are assumed to be people's own way to walk.
constexpr std::array<std::string_view, 2> kNeutralNames{"normal", "neutral"};
constexpr double kSettled_s = 0.3;  // of LiveStride
constexpr double kWindow_s = 1.0, kStep_s = 1.0 / 3.0;
constexpr double kShrink = 0.9;  // of the scatter within groups, towards a sphere

std::vector<std::string> reference_groups(const Dataset& dataset,
                                          const std::vector<std::string>& targets) {
  std::vector<std::string> groups;
  for (const AlignedClip& clip : dataset.clips) {
    if (!is_in(targets, clip.group) && !is_in(groups, clip.group)) groups.push_back(clip.group);
  }
  const auto neutral = std::ranges::find_first_of(groups, kNeutralNames);
  if (neutral != groups.end()) return {*neutral};
  return groups;
}

// The mean pose of the reference groups in the first motion that has them.
VectorXd neutral_of(const Dataset& dataset, const std::vector<std::string>& targets) {
  const auto cycles = clip_cycles(dataset);
  VectorXd sum = VectorXd::Zero(dataset.dims());
  int count = 0;
  for (const std::string& group : reference_groups(dataset, targets)) {
    for (const std::string& motion : dataset.motions) {
      const MatrixXd cycle = group_cycle(dataset, cycles, group, motion);
      if (cycle.size() == 0) continue;
      sum += cycle.row(0).transpose();
      ++count;
      break;
    }
  }
  return sum / std::max(count, 1);
}

// Of each person and day in the reference groups, motion by motion.
std::vector<MatrixXd> usual_of(const Dataset& dataset, const std::vector<std::string>& targets) {
  const auto cycles = clip_cycles(dataset);
  const auto groups = reference_groups(dataset, targets);
  std::vector<MatrixXd> usual;
  std::set<std::tuple<std::string, std::string, std::string>> seen;  // motion, group, unit
  for (const std::string& motion : dataset.motions) {
    for (const AlignedClip& clip : dataset.clips) {
      if (clip.motion != motion || !is_in(groups, clip.group)) continue;
      if (!seen.emplace(motion, clip.group, dataset.unit_of(clip)).second) continue;
      usual.push_back(group_cycle(dataset, cycles, clip.group, motion, dataset.unit_of(clip)));
    }
  }
  return usual;
}

double mean_swing_rad(const AlignedClip& clip, double rate_hz) {
  LiveStride stride;
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index t = 0; t < clip.leg.size(); ++t) {
    stride.update(clip.leg[t], 1.0 / rate_hz, clip.dtheta * rate_hz);
    if (static_cast<double>(t) < kSettled_s * rate_hz) continue;
    sum += stride.swing_rad();
    ++count;
  }
  return sum / std::max(count, 1);
}

// NaN where the clip gives none.
double mean_gait_correlation(const AlignedClip& clip, double rate_hz) {
  LiveGait gait;
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index t = 0; t < clip.leg.size(); ++t) {
    gait.update(clip.height_m[t], clip.leg[t], 1.0 / rate_hz);
    const double correlation = gait.correlation();
    if (std::isnan(correlation)) continue;
    sum += correlation;
    ++count;
  }
  return sum / count;
}

// The mean poses of a clip's windows of a second [windows x D].
MatrixXd window_means(const AlignedClip& clip, double rate_hz) {
  const Eigen::Index frames = clip.q.rows();
  const auto window = std::min<Eigen::Index>(frames, std::lround(kWindow_s * rate_hz));
  const auto step = std::max<Eigen::Index>(1, std::lround(kStep_s * rate_hz));
  const Eigen::Index count = 1 + (frames - window) / step;
  MatrixXd means(count, clip.q.cols());
  for (Eigen::Index i = 0; i < count; ++i) {
    means.row(i) = clip.q.middleRows(i * step, window).colwise().mean();
  }
  return means;
}

// The mean pose of a group, and the scatter of its windows about it.
struct GroupMean {
  VectorXd mean;
  MatrixXd scatter;
  Eigen::Index windows = 0;
};

GroupMean mean_of_group(const Dataset& dataset, const std::string& group) {
  std::vector<MatrixXd> parts;
  GroupMean found{VectorXd::Zero(dataset.dims()), MatrixXd::Zero(dataset.dims(), dataset.dims())};
  for (const AlignedClip& clip : dataset.clips) {
    if (clip.group != group) continue;
    parts.push_back(window_means(clip, dataset.rate_hz));
    found.mean += parts.back().colwise().sum().transpose();
    found.windows += parts.back().rows();
  }
  found.mean /= static_cast<double>(std::max<Eigen::Index>(found.windows, 1));
  for (const MatrixXd& part : parts) {
    const MatrixXd away = part.rowwise() - found.mean.transpose();
    found.scatter += away.transpose() * away;
  }
  return found;
}

}  // namespace

GateData gate_data_of(const Dataset& dataset, const std::vector<std::string>& targets) {
  GateData gate{.neutral = neutral_of(dataset, targets)};
  double swing_rad = std::numeric_limits<double>::infinity();
  double fastest_s = std::numeric_limits<double>::infinity();
  if (!std::ranges::all_of(dataset.clips, shows_strides)) return gate;
  for (const AlignedClip& clip : dataset.clips) {
    swing_rad = std::min(swing_rad, mean_swing_rad(clip, dataset.rate_hz));
    gate.gait_correlation =  // where any clip tells
        std::fmax(gate.gait_correlation, mean_gait_correlation(clip, dataset.rate_hz));
    fastest_s = std::min(fastest_s, 2.0 * std::numbers::pi / (clip.dtheta * dataset.rate_hz));
  }
  gate.swing_rad = swing_rad;
  gate.fastest_stride_s = fastest_s;
  gate.usual = usual_of(dataset, targets);
  return gate;
}

StyleAxis style_axis_of(const Dataset& dataset, const std::string& target) {
  const GroupMean goal = mean_of_group(dataset, target);
  MatrixXd scatter = goal.scatter;
  Eigen::Index windows = goal.windows;
  VectorXd source = VectorXd::Zero(dataset.dims());
  std::vector<std::string> groups;
  for (const AlignedClip& clip : dataset.clips) {
    if (clip.group == target || is_in(groups, clip.group)) continue;
    groups.push_back(clip.group);
    const GroupMean one = mean_of_group(dataset, clip.group);
    source += one.mean;
    scatter += one.scatter;
    windows += one.windows;
  }
  source /= static_cast<double>(groups.size());
  scatter /= static_cast<double>(std::max<Eigen::Index>(windows, 1));
  const double sphere = scatter.trace() / static_cast<double>(dataset.dims());
  MatrixXd within = (1.0 - kShrink) * scatter;
  within.diagonal().array() += kShrink * sphere + 1e-12;
  const VectorXd apart = goal.mean - source;
  const VectorXd axis = within.llt().solve(apart);
  const double length = axis.dot(apart);
  if (!(length > 0.0)) return {};
  return {axis / length, -axis.dot(source) / length};
}

}  // namespace posed::style
