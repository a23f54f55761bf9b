#include "models/style/train.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "models/style/harmonics.hpp"
#include "models/style/leave_out.hpp"
#include "models/style/training_check.hpp"
#include "models/style/training_pairs.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/json_text.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

constexpr double kLimitFactor = 1.5;  // of the largest difference in training

std::unexpected<Error> stopped() { return fail("training was stopped before it was done"); }

struct Learnt {
  gp::Trained process;
  MatrixXd differences;  // all differences in the training pairs [N x D]
  json kernel;
  bool follows_days = false;
  Way way{};  // of walkers held out; not measured where none could be held out
};

// Clips of a motion that lacks the target or a source give no training pairs; every group must give
// some.
Result<> check_groups(const std::vector<TrainingClip>& clips, const std::string& target) {
  std::set<std::pair<std::string, std::string>> there;  // (motion, group)
  for (const TrainingClip& clip : clips) there.emplace(clip.motion, clip.group);
  const auto has = [&](const std::string& motion, bool of_target) {
    return std::ranges::any_of(there, [&](const auto& entry) {
      return entry.first == motion && (entry.second == target) == of_target;
    });
  };
  for (const TrainingClip& clip : clips) {
    if (clip.group.empty()) {
      return fail("the clip is in no group; say which style it shows", clip.clip.path);
    }
    if (!has(clip.motion, true)) {
      return fail("motion " + clip.motion + " has no clip of the target group '" + target +
                      "'; add one or leave this clip out",
                  clip.clip.path);
    }
    if (!has(clip.motion, false)) {
      return fail("motion " + clip.motion + " has clips of the target group '" + target +
                      "' only; add a clip of another group to learn the difference from",
                  clip.clip.path);
    }
  }
  return {};
}

int cycle_frames(const Dataset& dataset, const std::string& motion) {
  double sum = 0.0;
  const auto members = dataset.clips_of(motion);
  for (const int c : members) sum += dataset.clips[c].dtheta;
  return static_cast<int>(
      std::lround(2.0 * std::numbers::pi * static_cast<double>(members.size()) / sum));
}

Result<Learnt> learn_default(const Dataset& dataset, const std::string& target, TaskRunner& tasks,
                             const FoldProgress& progress) {
  const auto pairs = make_training_pairs(dataset, take_cycles(dataset), target);
  const LeaveOut leave_out = make_folds(dataset, target);
  const auto chosen = leave_out.folds == 0 ? choose_kernel({.pairs = pairs}, tasks, progress)
                                           : choose_kernel(leave_out, tasks, progress);
  if (!chosen) return stopped();
  auto process = fit_difference(pairs, chosen->kernel);
  if (!process) return std::unexpected(process.error());
  Learnt learnt{
      std::move(*process), grid_outputs(pairs.outputs), {}, pairs.follows_days, chosen->way};
  learnt.kernel["length_chosen_by"] = leave_out.folds == 0 ? "default" : "leave-out";
  return learnt;
}

// The MGPM mean cycle of a group (the mean of its subjects' style points), columns of q only.
MatrixXd mgpm_group_cycle(const Dataset& dataset, std::size_t motion, const std::string& group,
                          const VectorXd& phase) {
  const MgpmFit& fit = dataset.fits[motion];
  VectorXd xi = VectorXd::Zero(fit.params.xi.cols());
  int count = 0;
  for (const Subject& s : dataset.subjects) {
    if (s.motion != dataset.motions[motion] || s.group != group) continue;
    xi += s.xi;
    ++count;
  }
  if (count == 0) return {};
  const MatrixXd live =
      mgpm_cycle(dataset.states[motion], fit.params, xi / count, phase, fit.harmonics);
  MatrixXd all = dataset.column_means[motion].transpose().replicate(phase.size(), 1);
  all(Eigen::all, dataset.live_columns[motion]) += live;
  return all.middleCols(3, dataset.dims());
}

// The method of Sato et al. (--mode paper): mean source cycle -> difference of the mean cycles,
// kernel values by evidence.
Result<Learnt> learn_paper(const Dataset& dataset, const std::string& target) {
  std::set<std::string> sources;
  for (const Subject& s : dataset.subjects) {
    if (s.group != target) sources.insert(s.group);
  }
  MatrixXd X(0, dataset.dims());
  MatrixXd Y(0, dataset.dims());
  for (std::size_t m = 0; m < dataset.motions.size(); ++m) {
    const VectorXd phase = cycle_phases(cycle_frames(dataset, dataset.motions[m]));
    const MatrixXd goal = mgpm_group_cycle(dataset, m, target, phase);
    for (const std::string& group : sources) {
      const MatrixXd cycle = mgpm_group_cycle(dataset, m, group, phase);
      if (cycle.size() == 0) continue;
      X.conservativeResize(X.rows() + cycle.rows(), Eigen::NoChange);
      Y.conservativeResize(X.rows(), Eigen::NoChange);
      X.bottomRows(cycle.rows()) = cycle;
      Y.bottomRows(cycle.rows()) = goal - cycle;
    }
  }
  auto process = fit_paper(X, Y);
  if (!process) return std::unexpected(process.error());
  return Learnt{std::move(*process), Y, {{"length_chosen_by", "evidence"}}};
}

// How much of the distance to the target the process closes on its own training clips.
Way way_on_training(const Dataset& dataset, const Learnt& learnt, const std::string& target) {
  const auto takes = take_cycles(dataset);
  const auto differences = differences_of(dataset, takes, target);
  Way way;
  for (const AlignedClip& clip : dataset.clips) {
    for (const Difference& d : differences) {
      if (d.group != clip.group || d.motion != clip.motion) continue;
      const MatrixXd goal = goal_of(dataset, takes, clip, d, target);
      way.add(way_of(clip.q, clip.phase(), goal, gp::posterior_mean(learnt.process, clip.q),
                     d.delta.row(0)));
    }
  }
  return way;
}

TrainingCheck check_learnt(const Dataset& dataset, const Learnt& learnt,
                           const std::string& target) {
  if (learnt.way.measured()) {
    return check_training(dataset, target, learnt.way, ClosingBy::kLeaveOut);
  }
  return check_training(dataset, target, way_on_training(dataset, learnt, target),
                        ClosingBy::kTraining);
}

json check_json(const TrainingCheck& check, const std::string& target) {
  json out{{"difference_deg", check.difference_deg},
           {"scatter_deg", check.scatter_deg},
           {"closes", nullptr},
           {"constant_closes", nullptr},
           {"problems", check.problems},
           {"warnings", check.warnings},
           {"usable", check.usable()},
           {"verdict", check.verdict(target)}};
  if (check.way.measured()) {
    out["closes"] = check.way.closes();
    out["constant_closes"] = check.way.constant_closes();
    out["closes_measured_on"] =
        check.closing_by == ClosingBy::kLeaveOut ? "held-out clips" : "training clips";
  }
  return out;
}

json report_of(const Dataset& dataset, const Learnt& learnt) {
  json report;
  report["subjects"] = json::array();
  for (const Subject& s : dataset.subjects) {
    report["subjects"].push_back({{"name", s.name},
                                  {"group", s.group},
                                  {"motion", s.motion},
                                  {"xi", std::vector<double>(s.xi.begin(), s.xi.end())}});
  }
  report["clips"] = json::array();
  for (const AlignedClip& clip : dataset.clips) {
    report["clips"].push_back({{"file", clip.file},
                               {"group", clip.group},
                               {"subject", dataset.subjects[clip.subject].name},
                               {"motion", clip.motion},
                               {"frames", clip.q.rows()},
                               {"dropped_first_frame", clip.dropped_first},
                               {"period_frames", 2.0 * std::numbers::pi / clip.dtheta},
                               {"stride_score", clip.stride_score},
                               {"residual_deg", cycle_residual_deg(dataset, clip)},
                               {"theta0", clip.theta0}});
  }
  for (const std::string& motion : dataset.motions) {
    report["cycle_frames"][motion] = cycle_frames(dataset, motion);
  }
  for (std::size_t m = 0; m < dataset.fitted.size(); ++m) {
    const std::string& motion = dataset.fitted[m];
    const MgpmFit& fit = dataset.fits[m];
    report["mgpm"][motion] = {{"gamma", std::exp(fit.params.log_gamma)},
                              {"noise", std::exp(fit.params.log_noise)},
                              {"log_posterior", -fit.nlp}};
    report["log_likelihood"]["mgpm"][motion] = -(fit.nlp - mgpm_prior_nlp(fit.prior, fit.params));
  }
  const gp::Trained& p = learnt.process;
  report["kernel"] = learnt.kernel;
  report["kernel"]["lambda"] = p.lambda;
  report["kernel"]["mu"] = p.mu;
  report["kernel"]["b"] = p.b;
  report["kernel"]["length_deg"] = 1.0 / (kDegree * std::sqrt(p.mu));
  report["follows_days"] = learnt.follows_days;
  report["noise"] = p.noise;
  if (p.inputs.rows() == learnt.differences.rows()) {  // with inducing poses there is no evidence
    const MatrixXd residual = learnt.differences.rowwise() - p.offset.transpose();
    const gp::Hyper hyper{p.lambda, std::log(p.mu), std::log(p.b), std::log(p.noise)};
    report["log_likelihood"]["gp"] = gp::log_marginal(p.inputs, residual, hyper).log_likelihood;
  }
  report["pose_space"] = motion::space_name(dataset.spec.space);
  report["dims"] = dataset.dims();
  report["rate_hz"] = dataset.rate_hz;
  report["training_points"] = p.inputs.rows();
  return report;
}

void set_input_statistics(const Dataset& dataset, StyleModel& model) {
  VectorXd sum = VectorXd::Zero(dataset.dims());
  VectorXd squares = sum;
  double frames = 0.0;
  for (const AlignedClip& clip : dataset.clips) {
    if (clip.group == model.to) continue;
    sum += clip.q.colwise().sum().transpose();
    squares += clip.q.colwise().squaredNorm().transpose();
    frames += static_cast<double>(clip.q.rows());
  }
  model.input_mean = sum / frames;
  model.input_sd = (squares / frames - model.input_mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
}

std::string joined_sources(const Dataset& dataset, const std::string& target) {
  std::vector<std::string> names;
  for (const Subject& s : dataset.subjects) {
    if (s.group != target && std::ranges::find(names, s.group) == names.end()) {
      names.push_back(s.group);
    }
  }
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : "+") + name;
  return joined;
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
  if (auto checked = check_groups(clips, options.target); !checked) {
    return std::unexpected(checked.error());
  }
  if (auto checked = check_recordings(clips); !checked) return std::unexpected(checked.error());
  if (!report_step("reading poses", 0.0)) return stopped();
  DatasetOptions how = options.dataset;
  how.mgpm = options.mode == TrainMode::kPaper;
  auto dataset = make_dataset(clips, options.target, how);
  if (!dataset) return std::unexpected(dataset.error());
  if (!report_step("aligning phases", 0.0)) return stopped();
  if (auto aligned = align(*dataset, how); !aligned) {
    return std::unexpected(aligned.error());
  }
  const auto progress = [&](double fraction) {
    return report_step("learning the difference", fraction);
  };
  if (!progress(0.0)) return stopped();
  SerialTasks serial;
  TaskRunner& tasks = how.tasks != nullptr ? *how.tasks : serial;
  auto learnt = options.mode == TrainMode::kPaper
                    ? learn_paper(*dataset, options.target)
                    : learn_default(*dataset, options.target, tasks, progress);
  if (!learnt) return std::unexpected(learnt.error());

  StyleModel model;
  model.to = options.target;
  model.from = joined_sources(*dataset, options.target);
  model.rate_hz = dataset->rate_hz;
  json report = report_of(*dataset, *learnt);
  report.update(check_json(check_learnt(*dataset, *learnt, options.target), options.target));
  model.report_json = json_text(report);
  model.limit_rad = kLimitFactor * learnt->differences.cwiseAbs().colwise().maxCoeff().transpose();
  set_input_statistics(*dataset, model);
  model.space = std::move(dataset->spec);
  model.process = std::move(learnt->process);
  if (!progress(1.0)) return stopped();
  return model;
}

}  // namespace posed::style
