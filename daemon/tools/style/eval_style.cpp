// `posed eval style`: how near a styled clip comes to the target.
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
source's figure; direction_error_deg: the same of the directions of arms, legs and trunk; their
floor is how far the two halves of the target are from each other; sink_cm: how far the lowest
styled toe is below the lowest unstyled one; root_speed_m_s: of the root over the ground, median
over a stride's time.
The last line is the verdict; the exit code is 1 when the model is no better than nothing.)";

constexpr double kCentimetres = 100.0;  // of a metre
constexpr double kShown = 0.005;        // a smaller share of the way reads as 0 %
constexpr double kRough = 1.5;          // a jerk_ratio above this is visible

struct EvalOptions {
  std::string model, source, target, skeleton, weights;
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
  Findings weights{};                     // of the styles
  std::optional<EvaluatedClips> clips{};  // for the report

  // By what the verdict shows: one that closes 0 % is no better than nothing.
  [[nodiscard]] bool helps() const { return score.cycle_ratio < 1.0 - kShown; }
};

std::string verdict(const Evaluation& e) {
  const double closes = 1.0 - e.score.cycle_ratio;
  const double constant = 1.0 - e.constant.cycle_ratio;
  std::string text = style::closing_text(closes);
  if (e.helps()) {
    text += " of the way to the target";
  } else if (closes > -kShown) {
    text = "no better than nothing: the styled walk is as far from the target as the source";
  } else {
    text = "worse than nothing: " + text + " from the target";
  }
  text += "; a constant offset " + style::closing_text(constant);
  if (e.helps() && constant > closes) text += ", which is better";
  if (e.score.jerk_ratio > kRough) {
    text +=
        fmt::format("; the styled walk is {:.1f} times as rough as the source", e.score.jerk_ratio);
  }
  if (e.fit.is_far()) {
    text +=
        fmt::format("; this walker is far from the training ({:.1f} deg rms)", e.fit.distance_deg);
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

Findings findings_of(const Evaluation& e, const EvalOptions& options) {
  const style::StyleScore& score = e.score;
  const std::string judged = verdict(e);
  return Findings()
      .add("alpha", options.alpha)
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
      .add("target_period_s", score.target_period_s)
      .add("weights", e.weights)
      .say_numbers()
      .add("verdict", judged)
      .verdict(judged, e.helps());
}

Result<> check_files(const EvalOptions& options) {
  return OutputFiles(options.report.overwrite)
      .reads_all(std::vector{options.model, options.source, options.target, options.skeleton})
      .writes(options.report.path, {".html"})
      .check();
}

Result<Evaluation> evaluate(const EvalOptions& options) {
  TRY(check_files(options));
  const bool any = clip::accepts(options.source, clip::ReadOption::kSkeleton) ||
                   clip::accepts(options.target, clip::ReadOption::kSkeleton);
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
