// `posed apply`: sends a clip through the style stage and writes the styled clip.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "daemon/tools/style/style_options.hpp"
#include "models/style/judge/walker_fit.hpp"
#include "models/style/live/apply.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"
#include "proto/text/number.hpp"

namespace posed::tools {
namespace {

struct ApplyArguments {
  std::filesystem::path model, in, out;
  clip::ReadOptions read;
  style::ApplyOptions apply{.feet = feet::RootOptions{}};
  const CLI::Option* root = nullptr;
  std::string mask, stream, take;
  std::filesystem::path neutral;
  std::string alpha = "1", gate = "on";
  bool overwrite = false, json = false;
};

// Reads --alpha: a number, or "auto", which is as much as the walker does not show already.
Result<> parse_alpha(ApplyArguments& options) {
  style::FilterOptions& filter = options.apply.filter;
  filter.auto_alpha = options.alpha == "auto";
  if (filter.auto_alpha) return {};
  const auto alpha = exact_number<double>(options.alpha);
  if (alpha && std::abs(*alpha) <= style::kMaxAlpha) {
    filter.alpha = *alpha;
    return {};
  }
  return misuse("--alpha takes a number from -2 to 2, or auto, not " + in_quotes(options.alpha));
}

// Reads --gate. `--gate` alone is `--gate on`, and `--gate IN` is `--gate on IN`: CLI11 gives the
// next word to the option.
Result<> parse_gate(ApplyArguments& options) {
  if (options.gate.empty()) options.gate = "on";
  if (options.gate != "on" && options.gate != "off") {
    if (!options.in.empty()) {
      return misuse("--gate takes on or off, not " + in_quotes(options.gate));
    }
    options.in = std::exchange(options.gate, "on");
  }
  options.apply.filter.gate = options.gate == "on";
  if (!options.in.empty()) return {};
  return misuse("no clip to style: posed apply --model FILE.style IN --out OUT.bvh");
}

Result<> check_files(const ApplyArguments& options) {
  const bool for_neutral = !options.neutral.empty();
  TRY(check_log_options(options.in.string(), !options.stream.empty() || !options.take.empty(),
                        for_neutral ? clip::ReadOptions() : options.read));
  return OutputFiles(options.overwrite)
      .reads(options.model)
      .reads(options.in)
      .reads(options.read.skeleton)
      .reads(options.neutral)
      .writes(options.out, clip::extensions(clip::Use::kWriteBody))
      .check();
}

// Why the clip came out as it went in; empty where it did not.
std::string unchanged(const ApplyArguments& options, const style::Applied& applied) {
  constexpr double kClosed = 0.01;  // of the gate, on average
  if (applied.joints_changed > 0) return {};
  const style::FilterOptions& filter = options.apply.filter;
  std::string why;
  if (!filter.auto_alpha && filter.alpha == 0.0) {
    why = ", because --alpha is 0";
  } else if (applied.gate_mean.value_or(1.0) < kClosed) {
    why = ", because the model does not know this motion; --gate off styles it all the same";
  } else if (filter.auto_alpha) {
    why = ", because the walker shows the style already";
  } else if (!options.mask.empty()) {
    why = ", because --mask leaves nothing of the style";
  }
  return "no joint was changed" + why;
}

// How much the style changed in its training, as the model says; 0: it does not.
double training_deg_of(const style::StyleModel& model) {
  const nlohmann::json report = parse_json(model.report_json);
  const auto found = report.find("difference_deg");
  return found != report.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string verdict(const style::WalkerFit& fit, double rms_deg, const style::StyleModel& model) {
  if (!fit.is_far()) {
    return fmt::format(
        "this walker is like those of the training ({:.1f} deg rms from the nearest "
        "pose it learnt from)",
        fit.distance_deg);
  }
  std::string text = fmt::format(
      "this walker is far from the training ({:.1f} deg rms from the nearest pose it "
      "learnt from; its own walkers are within {:.0f}): the change is a guess",
      fit.distance_deg, style::WalkerFit::kFar_deg);
  // Of several styles it gives none.
  if (const double training_deg = training_deg_of(model); training_deg > 0.0) {
    text += fmt::format(", {:.1f} deg rms where its training had {:.1f}", rms_deg, training_deg);
  }
  return text;
}

Findings findings_of(const ApplyArguments& options, const style::StyleModel& model,
                     const style::Shares& shares, const clip::Clip& clip,
                     const style::Applied& applied, const style::WalkerFit& fit) {
  constexpr double kNearlyAll = 0.95;
  const double rms_deg = applied.rms_change_rad * kDegrees;
  const double max_deg = applied.max_change_rad * kDegrees;
  const std::string judged = verdict(fit, rms_deg, model);
  const std::string nothing = unchanged(options, applied);
  Findings findings;
  findings.add("out", options.out.string())
      .add("frames", clip.frames())
      .add("rate_hz", clip.frame_rate_hz)
      .add("from", model.from)
      .add("to", model.to)
      .add("weights", mixture_findings(model.names(), shares))
      .add("mask", options.mask)
      .add("alpha", options.apply.filter.alpha)
      .add("alpha_used", applied.alpha)
      .add("auto_alpha", options.apply.filter.auto_alpha)
      .add("style_estimate", applied.estimate_mean)
      .add("cold", options.apply.cold)
      .add("root", root_text(applied.no_feet.empty() ? options.apply.feet : std::nullopt))
      .add("max_root_offset_cm", applied.max_root_offset_m * 100.0)
      .add("gate_mean", applied.gate_mean)
      .add("hinge_held", applied.hinge_held)
      .add("joints_changed", applied.joints_changed)
      .add("rms_change_deg", rms_deg)
      .add("max_change_deg", max_deg)
      .say(fmt::format("{}: {} frames, {} joints changed by {:.1f} deg rms, {:.1f} deg at most",
                       options.out.string(), clip.frames(), applied.joints_changed, rms_deg,
                       max_deg))
      .add("distance_deg", fit.distance_deg)
      .add("far_from_training", fit.is_far())
      .add("verdict", judged)
      .add("unchanged", nothing.empty() ? std::optional<std::string>() : nothing);
  if (!nothing.empty()) findings.warn({nothing});
  if (applied.kept_first) {
    findings.remark("the first frame is a rest pose without motion, and stays as it is");
  }
  if (is_log(options.in)) {
    findings.remark("the log's poses are taken as they came in, before the stages of their stream");
  }
  const double known = applied.gate_mean.value_or(1.0);
  if (nothing.empty() && known < kNearlyAll) {
    findings.remark(
        fmt::format("styled for {:.0f} % of the time: the rest is motion that the model"
                    " does not know",
                    100.0 * known));
  }
  if (nothing.empty() && !applied.no_feet.empty()) {
    findings.remark("the figure is styled without standing feet: " + applied.no_feet);
  } else if (nothing.empty() && !options.apply.feet) {
    findings.remark("the root moves as it did, so feet may slide; without --root off they stand");
  }
  return findings.remark((fit.is_far() ? "warning: " : "") + judged);
}

// A log's stream is styled as it came in, because its published poses may have a style already.
Result<clip::Clip> read(const ApplyArguments& options) {
  if (!is_log(options.in)) return clip::read_clip(options.in, options.read);
  const Waiting waiting("reading " + options.in.string());
  auto clip = TRY(clip_of_log(options.in, options.stream, options.take, true));
  clip::hold_missing(clip);
  clip::hold_gaps(clip);
  return clip;
}

// Measures how the walker of --neutral usually walks.
Result<> measure_neutral(const style::StyleModel& model, ApplyArguments& options) {
  if (options.neutral.empty()) return {};
  const auto neutral =
      TRY(clip::read_clip(options.neutral, clip::accepted_options(options.neutral, options.read)));
  const auto walker = TRY(style::measure_walker(model, options.model.string(), neutral));
  options.apply.walker = walker;
  return {};
}

Result<> run(ApplyArguments options) {
  TRY(parse_gate(options));
  TRY(parse_alpha(options));
  TRY(check_files(options));
  options.apply.needs_feet = !options.root->empty();
  const auto model = TRY(style::load_model(options.model));
  if (options.apply.filter.auto_alpha && !model.axis.present()) {
    return misuse(
        "the model has no style axis, so --alpha auto cannot tell how much is missing: "
        "give a number, or train a model of one style with this version of posed",
        options.model.string());
  }
  const auto shares = TRY(style::shares_of(options.apply.filter.weights, model.names()));
  const auto mask = TRY(style::mask_of(options.mask));
  options.apply.filter.mask = mask;
  const auto clip = TRY(read(options));
  for (const std::string& warning : clip.warnings) {
    std::fprintf(stderr, "posed: %s\n", clean(options.in.string() + ": " + warning).c_str());
  }
  TRY(measure_neutral(model, options));
  if (options.apply.filter.gate && !model.gate.present()) {
    std::fprintf(stderr,
                 "posed: %s: has no data for the gate, so any motion is styled; train it "
                 "again, or use --gate off\n",
                 options.model.c_str());
  }
  ProgressBar bar(kQuietFor_s);
  options.apply.progress = [&bar](int done, int total) {
    return bar.show("styling", static_cast<double>(done) / total);
  };
  const auto applied =
      TRY(style::apply_to_clip(model, options.model.string(), clip, options.apply));
  const auto fit = TRY(style::fit_of_walker(model, options.model.string(), clip));
  TRY(clip::write_clip(applied.clip, options.out));
  bar.finish();
  if (!applied.remark.empty()) std::fprintf(stderr, "posed: %s\n", applied.remark.c_str());
  if (applied.alpha != options.apply.filter.alpha) {
    std::fprintf(
        stderr,
        "posed: --alpha %s is held at %.1f: more would put arms into the head or the trunk "
        "of this figure\n",
        options.alpha.c_str(), applied.alpha);
  }
  if (applied.hinge_held) {
    std::fprintf(stderr,
                 "posed: knees or elbows are kept from bending backwards, which this alpha would "
                 "have them do\n");
  }
  findings_of(options, model, shares, clip, applied, fit).show(options.json);
  return {};
}

}  // namespace

void add_apply(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("apply", "Style a recorded clip: the code of the live filter");
  auto options = std::make_shared<ApplyArguments>();
  style::FilterOptions& filter = options->apply.filter;
  command->add_option("--model", options->model, "What `posed train style` wrote")
      ->required()
      ->type_name("FILE.style");
  command
      ->add_option("in", options->in,
                   "The clip: " + clip::listed(clip::Use::kReadBody) + "; or a log (.plog)")
      ->type_name("IN");
  command->add_option("--out", options->out, "To write: " + clip::listed(clip::Use::kWriteBody))
      ->required()
      ->type_name("OUT.bvh");
  command
      ->add_option("--alpha", options->alpha,
                   "How much: 0 none, 1 the target, negative away; auto: as much as is missing")
      ->type_name("A|auto")
      ->capture_default_str();
  command->add_option("--weights", filter.weights, "Mixes the model's styles: A=0.6,B=0.4")
      ->type_name("WEIGHTS");
  command->add_option("--mask", options->mask, "Styles parts of the body less: arms=0.5,head=0")
      ->type_name("MASK");
  options->root = add_root_option(*command, options->apply.feet);
  command->add_option("--stream", options->stream,
                      "Which of a log's streams (default: the only one)");
  command->add_option("--take", options->take, "Only this take of a log: its number or its name");
  command->add_option("--skeleton", options->read.skeleton, "NN.asf of an AMC (default: beside it)")
      ->type_name("NN.asf");
  add_figure_options(*command, options->read);
  command->add_flag("--cold", options->apply.cold, "Start as a live stream starts");
  command
      ->add_option("--gate", options->gate,
                   "on (the default) or off: fade out where the model does not know the motion")
      ->type_name("[on|off]")
      ->expected(0, 1);
  command->add_option("--neutral", options->neutral, "How this walker usually walks: a clip as IN")
      ->type_name("N.bvh");
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "Summary as one JSON object on stdout");
  command->footer(R"(Examples:
  posed apply --model walk.style walk_03.bvh --out styled.bvh
  posed apply --model walk.style --root off walk_03.bvh --out styled.bvh   # feet slide
  posed apply --model walk.style --alpha 0.5 07_01.amc --skeleton 07.asf --out half.bvh
  posed apply --model walk.style --neutral bob_1.bvh bob_2.bvh --out bob.bvh   # a new walker
  posed apply --model walk.style --cold walk_03.bvh --out live.bvh   # as a stream with [feet]
  posed apply --model two.style --weights feminine=0.6,elderly=0.4 --mask arms=0.5 \
      walk_03.bvh --out mixed.bvh
  posed apply --model new.style take1.plog --stream walker --out restyled.bvh
A log's poses are those that came in, whatever style they were published with.
Weights count as shares of their sum; without them the model's first style has all. A mask leaves
parts that it does not name at 1; it has arms, legs, trunk, head and left-arm, right-arm, left-leg,
right-leg.
Feet stand: the root goes as far as the styled legs carry it, so the figure may leave its place by
metres (--root actor keeps the place). A figure without legs is styled without that.
OUT keeps the input's joints, channels, frame count and rate; an AMC becomes a BVH with Z, Y, X
rotations. Without --cold the style has its full strength from the first frame. The last line says
how far the walker is from those in the training data. "deg rms" is the angle between the
rotations before and after, over frames and changed joints.)");
  command->callback([options, &exit_code] { exit_code = report(run(*options)); });
}

}  // namespace posed::tools
