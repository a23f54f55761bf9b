#include "models/style/train/train.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include <Eigen/Cholesky>

#include "models/style/live/bone_turns.hpp"
#include "models/style/live/live_motion.hpp"
#include "models/style/train/target_training.hpp"
#include "models/style/train/train_report.hpp"
#include "models/style/train/training_check.hpp"
#include "models/style/train/training_pairs.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of each of a model's styles.
std::vector<std::string> targets_of(const TrainOptions& options) {
  std::vector<std::string> targets{options.target};
  targets.insert(targets.end(), options.more_targets.begin(), options.more_targets.end());
  return targets;
}

// The names with which live weights call the styles ("feminine=0.6,elderly=0.4").
Result<> check_targets(const std::vector<std::string>& targets, TrainMode mode) {
  if (targets.size() == 1) return {};
  if (mode == TrainMode::kPaper) return misuse("--mode paper learns one target; name only one");
  if (targets.size() > kMaxStyles) {
    return misuse("a model has at most " + std::to_string(kMaxStyles) + " targets, not " +
                  std::to_string(targets.size()));
  }
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const std::string& name = targets[i];
    if (name.empty() || name.find_first_of("=, ") != std::string::npos) {
      return misuse("target " + in_quotes(name) +
                    " needs a name without blank, comma and '=', because weights are written "
                    "feminine=0.6,elderly=0.4");
    }
    if (std::find(targets.begin(), targets.begin() + static_cast<std::ptrdiff_t>(i), name) !=
        targets.begin() + static_cast<std::ptrdiff_t>(i)) {
      return misuse("target " + in_quotes(name) + " is named twice");
    }
  }
  return {};
}

// Clips of a motion that lacks the target or a source give no training pairs; every group must give
// some. The clips of other targets do not count.
Result<> check_groups(const std::vector<TrainingClip>& all, const std::vector<std::string>& targets,
                      const std::string& target) {
  std::vector<const TrainingClip*> clips;
  for (const TrainingClip& clip : all) {
    if (clip.group == target || !is_in(targets, clip.group)) clips.push_back(&clip);
  }
  std::set<std::pair<std::string, std::string>> there;  // (motion, group)
  for (const TrainingClip* clip : clips) there.emplace(clip->motion, clip->group);
  const auto has = [&](const std::string& motion, bool of_target) {
    return std::ranges::any_of(there, [&](const auto& entry) {
      return entry.first == motion && (entry.second == target) == of_target;
    });
  };
  for (const TrainingClip* clip : clips) {
    if (clip->group.empty()) {
      return fail("the clip is in no group; say which style it shows", clip->clip.path);
    }
    if (!has(clip->motion, true)) {
      const char* const remedy = targets.size() == 1 ? "'; add one or leave this clip out"
                                                     : "'; add one: every target needs each motion";
      return fail("motion " + clip->motion + " has no clip of the target group '" + target + remedy,
                  clip->clip.path);
    }
    if (!has(clip->motion, false)) {
      return fail("motion " + clip->motion + " has clips of the target group '" + target +
                      "' only; add a clip of another group to learn the difference from",
                  clip->clip.path);
    }
  }
  return {};
}

std::string joined_sources(const Dataset& dataset, const std::vector<std::string>& targets) {
  std::vector<std::string> names;
  for (const Subject& s : dataset.subjects) {
    if (!is_in(targets, s.group) && !is_in(names, s.group)) names.push_back(s.group);
  }
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : "+") + name;
  return joined;
}

VectorXd limit_of(const Learnt& learnt) {
  return kLimitFactor * learnt.differences.cwiseAbs().colwise().maxCoeff().transpose();
}

std::vector<double> places_of(const motion::PoseSpaceSpec& spec, const Skeleton& skeleton) {
  std::vector<double> places;
  if (spec.space != motion::Space::kHumanoid) return places;
  const std::vector<double> of_figure = trunk_places(skeleton);
  for (const std::string& name : spec.joints) {
    const int joint = skeleton.joint_of(*bone_from_name(name));
    places.push_back(joint < 0 ? -1.0 : of_figure[static_cast<std::size_t>(joint)]);
  }
  return places;
}

StyleModel model_of(Dataset dataset, const std::vector<std::string>& targets,
                    std::vector<Learnt> learnt) {
  StyleModel model;
  model.to = targets.front();
  model.from = joined_sources(dataset, targets);
  model.rate_hz = dataset.rate_hz;
  model.limit_rad = limit_of(learnt.front());
  model.space = std::move(dataset.spec);
  if (std::ranges::all_of(learnt, [](const Learnt& one) { return one.root.has_value(); })) {
    for (Learnt& one : learnt) model.roots.push_back(std::move(*one.root));
  }
  for (std::size_t i = 1; i < learnt.size(); ++i) {
    gp::Trained& process = learnt[i].process;
    model.more.push_back(
        {targets[i], {std::move(process.weights), std::move(process.offset)}, limit_of(learnt[i])});
  }
  model.process = std::move(learnt.front().process);
  return model;
}

// Computes, from the aligned training clips, what a style model stores besides the difference of
// styles: data for the gate, the warm-up and auto-alpha (models/style/train/README.md has a section
// on each). Cold.

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

// `targets`: the groups that are styles; the others are where a stranger starts from. If any clip
// shows no strides, only `neutral` is filled. `rigs` and `places` are left to the caller.
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

// `target`: one style. Empty if no other group is there or the means of both coincide.
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

}  // namespace

Result<TrainMode> mode_from_name(std::string_view name) {
  if (name == "default") return TrainMode::kDefault;
  if (name == "paper") return TrainMode::kPaper;
  return misuse("no training mode is called '" + std::string(name) + "'; choose default or paper");
}

Result<StyleModel> train_style(const std::vector<TrainingClip>& clips,
                               const TrainOptions& options) {
  const auto report_step = [&](const char* step, double fraction) {
    return !options.dataset.progress || options.dataset.progress(step, fraction);
  };
  const std::vector<std::string> targets = targets_of(options);
  TRY(check_targets(targets, options.mode));
  for (const std::string& target : targets) {
    TRY(check_groups(clips, targets, target));
  }
  TRY(check_recordings(clips));
  if (!report_step("reading poses", 0.0)) return training_stopped();
  DatasetOptions how = options.dataset;
  how.mgpm = options.mode == TrainMode::kPaper;
  auto dataset = TRY(make_dataset(clips, targets, how));
  if (!report_step("aligning phases", 0.0)) return training_stopped();
  TRY(align(dataset, how));
  const auto progress = [&](double fraction) {
    return report_step("learning the difference", fraction);
  };
  if (!progress(0.0)) return training_stopped();
  SerialTasks serial;
  TaskRunner& tasks = how.tasks != nullptr ? *how.tasks : serial;
  const std::vector<Lesson> lessons = lessons_of(dataset, targets);
  auto learnt =
      TRY(options.mode == TrainMode::kPaper ? learn_paper(dataset, options.target, tasks, progress)
                                            : learn_default(dataset, lessons, tasks, progress));

  const std::vector<TrainingCheck> checks = checks_of(lessons, learnt);
  const TrainingVerdict verdict = verdict_of(lessons, checks);
  const Findings findings{dataset, lessons, learnt, checks, verdict};
  if (options.look) options.look(findings);
  const std::string report = json_text(whole_report(findings));
  GateData gate = gate_data_of(dataset, targets);
  for (const TrainingClip& clip : clips) {
    const std::uint32_t rig = rig_id(*clip.clip.skeleton);
    if (std::ranges::find(gate.rigs, rig) == gate.rigs.end()) gate.rigs.push_back(rig);
  }
  gate.places = places_of(dataset.spec, *clips.front().clip.skeleton);
  StyleAxis axis;  // of a mixture there is none
  if (targets.size() == 1) axis = style_axis_of(dataset, options.target);
  StyleModel model = model_of(std::move(dataset), targets, std::move(learnt));
  model.report_json = report;
  model.gate = std::move(gate);
  model.axis = std::move(axis);
  if (!progress(1.0)) return training_stopped();
  return model;
}

}  // namespace posed::style
