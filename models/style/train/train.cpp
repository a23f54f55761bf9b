#include "models/style/train/train.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "models/style/live/bone_turns.hpp"
#include "models/style/train/gate_data.hpp"
#include "models/style/train/target_training.hpp"
#include "models/style/train/train_report.hpp"
#include "models/style/train/training_check.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"

namespace posed::style {
namespace {

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
