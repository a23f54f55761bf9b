// `posed eval style`: how near a styled clip comes to the target.
#include <algorithm>
#include <cmath>
#include <memory>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/style/style_options.hpp"
#include "daemon/tools/style/style_report.hpp"
#include "models/motion/motion.hpp"
#include "models/style/judge/body_cycle.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/judge/walker_fit.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/model/style_model.hpp"
#include "models/style/train/training_check.hpp"
#include "proto/clip/format.hpp"

namespace posed::tools {
namespace {

constexpr const char* kEvalFooter = R"(Examples:
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh --json
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh --report proud.html
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh --root stride
  posed eval style --model two.style --weights sad=1 --source plain_3.bvh --target sad_3.bvh
  posed eval style --model proud.style --source plain_3.bvh --target proud_3.bvh --neutral bob.bvh

The source goes through the same stage as live, and is compared in the model's pose space.
cycle_ratio: how far the styled walk's average cycle
is from the target's, over how far the unstyled one was (0 is the target, 1 is no change);
constant_cycle_ratio: the same for the model's average change alone, added to every frame; ratio:
cycle_ratio frame by frame; jerk_ratio: roughness of the styled walk over the unstyled one's;
moved_rms_deg: the angle between the rotations before and after, rms over frames and changed joints,
as `apply` reports it; component_rms_deg: the same change per component of the rotation vectors,
source_component_rms_deg: what 1.0 of cycle_ratio is, in the same measure;
gate_mean: how far the model knows the motion, 1 all of it, 0 nothing, which is not styled;
slide_cm_s: speed over the ground of ankles and toes that stand (slower than 10 cm/s in the
unstyled walk; of the target: in itself); height_error_cm, speed_error_m_s: how far the mean cycle
of the hips' height above the ground and of their speed is from the target's, in the size of the
source's figure; direction_error_deg: the same of the directions of arms, legs and trunk;
tempo_error: the share by which the cadence is off the target's; their floor is how far the two
halves of the target are from each other; sink_cm: how far the lowest styled toe is below the lowest
unstyled one; root_speed_m_s: of the root over the ground, median over a stride's time.
With --neutral, for each clip of a person who was not taught, after a warm-up on it: missing: the
part of what source and target teach, in directions of bones, that the walk does not get (1 if
unstyled; floor: what the halves of source and target differ by in it); arm_error_deg,
worst_arm_error_deg, lean_error_deg: how far the change of the arms and of the trunk's lean is from
the taught one.
The first line is the verdict; the exit code is 1 when the model is no better than nothing.)";

constexpr double kCentimetres = 100.0;  // of a metre
constexpr double kShown = 0.005;        // a smaller share of the way reads as 0 %
constexpr double kRough = 1.5;          // a jerk_ratio above this is visible

struct EvalOptions {
  std::string model, source, target, skeleton, weights;
  std::vector<std::string> neutral;
  double alpha = 1.0;
  std::optional<feet::RootOptions> feet;
  ReportFile report;
  bool json = false;
};

Result<clip::Clip> read(const std::string& path, const std::string& skeleton) {
  return clip::read_clip(path, clip::accepted_options(path, {.skeleton = skeleton}));
}

struct Evaluation {
  style::StyleScore score, constant;
  double moved_rms_deg = 0.0;
  std::optional<double> gate_mean{};
  style::WalkerFit fit;
  Findings weights{};  // of the styles
  std::vector<style::Arrival> strangers{};
  std::optional<EvaluatedClips> clips{};  // for the report

  // By what the verdict shows: one that closes 0 % is no better than nothing.
  [[nodiscard]] bool helps() const { return score.cycle_ratio < 1.0 - kShown; }
};

double mean_missing(const std::vector<style::Arrival>& strangers) {
  double sum = 0.0;
  for (const style::Arrival& one : strangers) sum += one.missing;
  return sum / static_cast<double>(strangers.size());
}

std::string verdict(const Evaluation& e) {
  const double closes = 1.0 - e.score.cycle_ratio;
  const double constant = 1.0 - e.constant.cycle_ratio;
  std::string text = style::closing_text(closes);
  if (e.helps()) {
    text = "shows " + text + " of the difference to the target";
  } else if (closes > -kShown) {
    text = "no better than nothing: the styled walk is as far from the target as the source";
  } else {
    text = "worse than nothing: it changes the walk " + text;
  }
  text += "; a fixed change of the pose would be " + style::closing_text(constant);
  if (e.helps() && constant > closes) text += ", which is better";
  if (e.score.jerk_ratio > kRough) {
    text +=
        fmt::format("; the styled walk is {:.1f} times as rough as the source", e.score.jerk_ratio);
  }
  if (e.fit.is_far()) {
    text +=
        fmt::format("; this walker is far from the training ({:.1f} deg rms)", e.fit.distance_deg);
  }
  if (!e.strangers.empty()) {
    text += fmt::format("; a walker who was not taught misses {:.0f} % of what was taught",
                        100.0 * mean_missing(e.strangers));
    const auto& floor = e.strangers.front().floor;
    if (floor)
      text += fmt::format(" (two takes of the teacher differ by {:.0f} %)", 100.0 * *floor);
  }
  return text;
}

std::optional<double> scaled(const std::optional<double>& value, double scale) {
  return value ? std::optional(*value * scale) : std::nullopt;
}

// NaN where it is not defined.
double slide_cm_s(const std::optional<double>& slide_m_s) {
  return slide_m_s ? *slide_m_s * kCentimetres : std::nan("");
}

Findings of_clips(const style::StyleScore::Clips& clips, double scale) {
  return Findings()
      .add("source", scaled(clips.source, scale))
      .add("styled", scaled(clips.styled, scale))
      .add("target", scaled(clips.target, scale));
}

// One of the errors of the body, of all who have it.
Findings body_error(const std::optional<style::BodyErrors>& body, double style::BodyError::* error,
                    double scale) {
  Findings findings;
  if (!body) return findings;
  findings.add("source", scale * body->source.*error).add("styled", scale * body->styled.*error);
  return findings.add("floor", body->floor ? std::optional(scale * (*body->floor).*error)
                                           : std::optional<double>());
}

// In the order of --neutral.
std::vector<Findings> of_strangers(const Evaluation& e, const EvalOptions& options) {
  std::vector<Findings> found;
  for (std::size_t i = 0; i < e.strangers.size(); ++i) {
    const style::Arrival& one = e.strangers[i];
    const auto pair = [](double styled_rad, double unstyled_rad) {
      return Findings().add("source", unstyled_rad * kDegrees).add("styled", styled_rad * kDegrees);
    };
    found.push_back(Findings()
                        .add("arm_error_deg", pair(one.arms_rad, one.unstyled_arms_rad))
                        .add("clip", options.neutral[i])
                        .add("floor", one.floor)
                        .add("lean_error_deg", pair(one.lean_rad, one.unstyled_lean_rad))
                        .add("missing", one.missing)
                        .add("worst_arm_error_deg", one.worst_arm_rad * kDegrees));
  }
  return found;
}

std::string number_text(const std::optional<double>& value) {
  return value ? fmt::format("{:10.2f}", *value) : fmt::format("{:>10}", "-");
}

// For people: what --json has, without its names.
void say_table(const Evaluation& e, Findings& findings) {
  const auto row = [&](const std::string& what, const std::optional<double>& styled,
                       const std::optional<double>& unstyled, const std::optional<double>& floor) {
    findings.say(fmt::format("{:<44}{}{}{}", what, number_text(styled), number_text(unstyled),
                             number_text(floor)));
  };
  const auto& score = e.score;
  findings.say(
      fmt::format("{:<44}{:>10}{:>10}{:>10}", "off the target by", "styled", "unstyled", "floor"));
  row("pose, mean cycle", score.cycle_ratio, 1.0, {});
  row("the same with a constant offset", e.constant.cycle_ratio, 1.0, {});
  row("roughness", score.jerk_ratio, 1.0, {});
  if (score.body) {
    const style::BodyErrors& body = *score.body;
    const auto error = [&](const std::string& what, double style::BodyError::* part, double scale) {
      row(what, scale * body.styled.*part, scale * body.source.*part,
          body.floor ? std::optional(scale * (*body.floor).*part) : std::optional<double>());
    };
    error("height of the hips [cm]", &style::BodyError::height, body.leg_m * kCentimetres);
    error("speed of the hips [m/s]", &style::BodyError::speed_s, body.leg_m);
    error("directions of bones [deg]", &style::BodyError::direction_rad, kDegrees);
    error("tempo [%]", &style::BodyError::tempo, 100.0);
  }
  row("slide of standing feet [cm/s]", scaled(score.slide_m_s.styled, kCentimetres),
      scaled(score.slide_m_s.source, kCentimetres), scaled(score.slide_m_s.target, kCentimetres));
  for (const style::Arrival& one : e.strangers) {
    row("not taught: missing of what was taught", one.missing, 1.0, one.floor);
    row("  arms [deg]", one.arms_rad * kDegrees, one.unstyled_arms_rad * kDegrees, {});
    row("  lean [deg]", one.lean_rad * kDegrees, one.unstyled_lean_rad * kDegrees, {});
  }
}

Findings findings_of(const Evaluation& e, const EvalOptions& options) {
  const style::StyleScore& score = e.score;
  const std::string judged = verdict(e);
  Findings findings;
  findings.add("alpha", options.alpha)
      .add("component_rms_deg", score.component_rms_deg)
      .add("constant_cycle_ratio", e.constant.cycle_ratio)
      .add("cycle_ratio", score.cycle_ratio)
      .add("direction_error_deg",
           body_error(score.body, &style::BodyError::direction_rad, kDegrees))
      .add("distance_deg", e.fit.distance_deg)
      .add("far_from_training", e.fit.is_far())
      .add("gate_mean", e.gate_mean)
      .add("height_error_cm", body_error(score.body, &style::BodyError::height,
                                         score.body ? score.body->leg_m * kCentimetres : 1.0))
      .add("helps", e.helps())
      .add("jerk_ratio", score.jerk_ratio)
      .add("moved_rms_deg", e.moved_rms_deg)
      .add("ratio", score.ratio)
      .add("root", root_text(options.feet))
      .add("root_speed_m_s", of_clips(score.root_speed_m_s, 1.0))
      .add("sink_cm", scaled(score.sink_m, kCentimetres))
      .add("slide_cm_s", of_clips(score.slide_m_s, kCentimetres))
      .add("source_component_rms_deg", score.source_component_rms_deg)
      .add("source_period_s", score.source_period_s)
      .add("speed_error_m_s",
           body_error(score.body, &style::BodyError::speed_s, score.body ? score.body->leg_m : 1.0))
      .add("strangers", of_strangers(e, options))
      .add("target_period_s", score.target_period_s)
      .add("tempo_error", body_error(score.body, &style::BodyError::tempo, 1.0))
      .add("verdict", judged)
      .add("weights", e.weights)
      .headline(judged, e.helps());
  say_table(e, findings);
  return findings;
}

Result<> check_files(const EvalOptions& options) {
  return OutputFiles(options.report.overwrite)
      .reads_all(std::vector{options.model, options.source, options.target, options.skeleton})
      .reads_all(options.neutral)
      .writes(options.report.path, {".html"})
      .check();
}

// What the clips of people who were not taught get of what source and target teach.
Result<std::vector<style::Arrival>> look_at_strangers(const EvalOptions& options,
                                                      const style::StyleModel& model,
                                                      const clip::Clip& source,
                                                      const clip::Clip& target) {
  std::vector<style::Arrival> found;
  if (options.neutral.empty()) return found;
  const auto from = TRY(motion::performed_motion_of(source));
  const auto to = TRY(motion::performed_motion_of(target));
  for (const std::string& path : options.neutral) {
    const auto clip = TRY(read(path, options.skeleton));
    style::ApplyOptions apply;
    apply.filter.alpha = options.alpha;
    apply.filter.weights = options.weights;
    apply.walker = TRY(style::measure_walker(model, options.model, clip));
    const auto styled = TRY(style::apply_to_clip(model, options.model, clip, apply));
    const auto walk = TRY(motion::performed_motion_of(clip));
    const auto styled_walk = TRY(motion::performed_motion_of(styled.clip));
    const auto one = style::arrival(walk, styled_walk, from, to);
    if (!one) return fail("shows no walk with legs, as the source or the target", path);
    found.push_back(*one);
  }
  return found;
}

Result<Evaluation> evaluate(const EvalOptions& options) {
  TRY(check_files(options));
  const auto takes_skeleton = [](const std::string& path) {
    return clip::accepts(path, clip::ReadOption::kSkeleton);
  };
  const bool any = takes_skeleton(options.source) || takes_skeleton(options.target) ||
                   std::ranges::any_of(options.neutral, takes_skeleton);
  if (!options.skeleton.empty() && !any) {
    return misuse("--skeleton is only for AMC clips; leave it out");
  }
  const auto model = TRY(style::load_model(options.model));
  const auto source = TRY(read(options.source, options.skeleton));
  const auto target = TRY(read(options.target, options.skeleton));
  const auto shares = TRY(style::shares_of(options.weights, model.names()));
  const style::StyleModel mixture = style::mixture_of(model, shares.all());
  const auto fit = TRY(style::fit_of_walker(mixture, options.model, source));
  const style::StyleModel constant = style::with_constant_change(mixture, fit.mean_change);
  ProgressBar bar(kQuietFor_s);
  Evaluation evaluation{
      .score = {}, .constant = {}, .fit = fit, .weights = mixture_findings(model.names(), shares)};
  for (const bool full : {false, true}) {
    style::ApplyOptions apply;
    apply.filter.alpha = options.alpha;
    if (full) apply.filter.weights = options.weights;
    apply.feet = options.feet;
    apply.progress = [&](int done, int total) {
      return bar.show("styling", 0.5 * full + 0.5 * done / total);
    };
    const auto styled =
        TRY(style::apply_to_clip(full ? model : constant, options.model, source, apply));
    const auto score = TRY(style::evaluate_style(source, styled.clip, target, model.space));
    (full ? evaluation.score : evaluation.constant) = score;
    evaluation.gate_mean = styled.gate_mean;
    evaluation.moved_rms_deg = styled.rms_change_rad * kDegrees;
    if (full && options.report.wanted()) {
      evaluation.clips = {.source = source,
                          .styled = styled.clip,
                          .target = target,
                          .space = model.space.space,
                          .rate_hz = model.rate_hz};
    }
  }
  evaluation.strangers = TRY(look_at_strangers(options, model, source, target));
  return evaluation;
}

int finish(const Evaluation& evaluation, const EvalOptions& options) {
  const Findings findings = findings_of(evaluation, options);
  const int exit_code = findings.show(options.json);
  if (evaluation.clips) {
    const auto& score = evaluation.score;
    const auto written =
        write_eval_style_report({.findings = findings,
                                 .verdict = verdict(evaluation),
                                 .helps = evaluation.helps(),
                                 .distances = {{"unstyled", 1.0},
                                               {"constant offset", evaluation.constant.cycle_ratio},
                                               {"styled", score.cycle_ratio},
                                               {"styled, frame by frame", score.ratio}},
                                 .slides_cm_s = {{"source", slide_cm_s(score.slide_m_s.source)},
                                                 {"styled", slide_cm_s(score.slide_m_s.styled)},
                                                 {"target", slide_cm_s(score.slide_m_s.target)}}},
                                *evaluation.clips, options.report.path);
    if (!written) return report(written.error());
  }
  return exit_code;
}

}  // namespace

void add_eval_style(CLI::App& eval, int& exit_code) {
  CLI::App* style = eval.add_subcommand("style", "How near a styled clip comes to the target");
  style->footer(kEvalFooter);
  const auto options = std::make_shared<EvalOptions>();
  style->add_option("--model", options->model, "Model from `posed train style`")->required();
  style->add_option("--source", options->source, "Clip to be styled")->required();
  style->add_option("--target", options->target, "Clip in the target style")->required();
  style->add_option("--neutral", options->neutral, "Usual walks of people who were not taught");
  style->add_option("--skeleton", options->skeleton, "NN.asf of AMC clips, if not beside them");
  style->add_option("--weights", options->weights, "Mixes the model's styles: A=0.6,B=0.4")
      ->type_name("WEIGHTS");
  style->add_option("--alpha", options->alpha, "How much style")
      ->check(in_range(-2.0, 2.0))
      ->capture_default_str();
  add_root_option(*style, options->feet);
  add_report_file(*style, options->report);
  style->add_flag("--json", options->json, "One JSON object on stdout");
  style->callback([options, &exit_code] {
    const auto evaluation = evaluate(*options);
    exit_code = evaluation ? finish(*evaluation, *options) : report(evaluation.error());
  });
}

}  // namespace posed::tools
