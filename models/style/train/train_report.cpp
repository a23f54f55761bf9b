#include "models/style/train/train_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "models/style/train/training_check.hpp"
#include "models/style/train/training_pairs.hpp"
#include "proto/frame/degree.hpp"

namespace posed::style {
namespace {

using Eigen::MatrixXd;
using nlohmann::json;

// How much of the distance to the target the process closes on its own training clips.
Way way_on_training(const Dataset& dataset, const Learnt& learnt, const std::string& target) {
  const auto cycles = clip_cycles(dataset);
  const auto differences = differences_of(dataset, cycles, target);
  Way way;
  for (const AlignedClip& clip : dataset.clips) {
    for (const Difference& d : differences) {
      if (d.group != clip.group || d.motion != clip.motion) continue;
      const MatrixXd goal = goal_of(dataset, cycles, clip, d, target);
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

// What training found out about one of several styles.
json style_json(const TrainingCheck& check, const std::string& target) {
  json report{{"name", target}};
  report.update(check_json(check, target));
  return report;
}

void add_sentences(const std::string& name, const std::vector<std::string>& sentences,
                   std::vector<std::string>& all) {
  for (const std::string& sentence : sentences) {
    std::string text = name + ": " + sentence;
    if (std::ranges::find(all, text) == all.end()) all.push_back(std::move(text));
  }
}

// `alone`: the process is that of the only style.
json report_of(const Dataset& dataset, const Learnt& learnt, bool alone) {
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
                               {"day", dataset.subjects[clip.subject].day},
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
  report["kernel"]["length_chosen_by"] = learnt.length_chosen_by;
  report["kernel"]["lambda"] = p.lambda;
  report["kernel"]["mu"] = p.mu;
  report["kernel"]["b"] = p.b;
  report["kernel"]["length_deg"] = 1.0 / (kDegree * std::sqrt(p.mu));
  report["noise"] = p.noise;
  if (alone &&
      p.inputs.rows() == learnt.differences.rows()) {  // with inducing poses there is no evidence
    const MatrixXd residual = learnt.differences.rowwise() - p.offset.transpose();
    const gp::Hyper hyper{p.lambda, std::log(p.mu), std::log(p.b), std::log(p.noise)};
    report["log_likelihood"]["gp"] =
        gp::log_marginal(p.scaled(p.inputs), residual, hyper).log_likelihood;
  }
  report["pose_space"] = motion::space_name(dataset.spec.space);
  report["dims"] = dataset.dims();
  report["rate_hz"] = dataset.rate_hz;
  report["training_points"] = p.inputs.rows();
  return report;
}

}  // namespace

std::vector<TrainingCheck> checks_of(const std::vector<Lesson>& lessons,
                                     const std::vector<Learnt>& learnt) {
  std::vector<TrainingCheck> checks;
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    checks.push_back(check_learnt(*lessons[i].data, learnt[i], lessons[i].target));
  }
  return checks;
}

TrainingVerdict verdict_of(const std::vector<Lesson>& lessons,
                           const std::vector<TrainingCheck>& checks) {
  if (checks.size() == 1) {
    const TrainingCheck& check = checks.front();
    return {check.usable(), check.problems, check.warnings, check.verdict(lessons.front().target)};
  }
  TrainingVerdict verdict;
  std::string unusable;
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const std::string& name = lessons[i].target;
    const std::string line = name + ": " + checks[i].verdict(name);
    verdict.sentence += (verdict.sentence.empty() ? "" : "; ") + line;
    if (unusable.empty() && !checks[i].usable()) unusable = line;
    add_sentences(name, checks[i].problems, verdict.problems);
    add_sentences(name, checks[i].warnings, verdict.warnings);
  }
  verdict.usable = unusable.empty();
  if (!verdict.usable) verdict.sentence = unusable;
  return verdict;
}

json whole_report(const Findings& findings) {
  const auto& [dataset, lessons, learnt, checks, verdict] = findings;
  json report = report_of(dataset, learnt.front(), lessons.size() == 1);
  if (lessons.size() == 1) {
    report.update(check_json(checks.front(), lessons.front().target));
    return report;
  }
  json styles = json::array();
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    styles.push_back(style_json(checks[i], lessons[i].target));
  }
  report.update({{"targets", styles},
                 {"usable", verdict.usable},
                 {"problems", verdict.problems},
                 {"warnings", verdict.warnings},
                 {"verdict", verdict.sentence}});
  return report;
}

}  // namespace posed::style
