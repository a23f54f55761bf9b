// `posed synth`: performs a sequence of labels with a hand or a body and writes a file.
#include <cmath>
#include <memory>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/play_order.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/constrain.hpp"
#include "models/perform/perform.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/text/number.hpp"

namespace posed::tools {
namespace {

constexpr const char* kSynthFooter = R"(Examples:
  posed synth --model hand.gesture --labels "g 1 c 3 4 p" --out hand.csv
  posed synth --model hand.gesture --labels "g c p" --tempo 1.5 --hand left --out hand.bvh --json
  posed synth --model body.gesture --labels "raise-both rest" --body take.bvh --out both.bvh

Labels that were never recorded are performed too, finger by finger, when the model's classes name
them, and by a body group by group. A body has the skeleton of --body and stands where that stands
in its first frame. --lookahead N performs as a stream that knows the labels N frames ahead (20 is
enough for the eye). The same motion plays in a running daemon with `posed ctl play`.)";

struct SynthOptions {
  std::string model, labels, out;
  std::string body;  // a clip of the body that performs
  double tempo = 1.0;
  std::string lookahead = "full", hand = "right";
  std::string shape{kDefaultHandShape};
  bool global_variance = false, unconstrained = false, overwrite = false, json = false;
};

Result<perform::PerformOptions> perform_options(const SynthOptions& options) {
  perform::PerformOptions perform;
  perform.tempo = options.tempo;
  perform.global_variance = options.global_variance;
  if (options.lookahead == "full") return perform;
  const int frames = exact_number<int>(options.lookahead).value_or(-1);
  constexpr int kMaxFrames = 100'000;
  if (frames < 0 || frames > kMaxFrames) {
    return misuse("--lookahead is a number of frames or full, not '" + options.lookahead + "'");
  }
  perform.look_ahead = frames;
  return perform;
}

Result<> write_hand(const clip::HandClip& hand, const SynthOptions& options) {
  const auto clip = TRY(clip::clip_of_hand(hand, options.shape));
  return clip::write_clip(clip, options.out);
}

// The states of the performance; those of a label begin with a line for it.
std::vector<Findings> findings_of(const gesture::GestureModel& model,
                                  const perform::Performance& performance) {
  std::vector<Findings> states;
  for (std::size_t i = 0; i < performance.states.size(); ++i) {
    const perform::PerformedState& state = performance.states[i];
    const std::string& label = model.labels[state.context.current].name;
    Findings leaf;
    for (std::size_t g = 0; g < model.groups.size(); ++g) {
      leaf.add(model.groups[g].name, state.leaf[g]);
    }
    states.push_back(Findings()
                         .add("label", label)
                         .add("state", state.state + 1)
                         .add("start", state.start)
                         .add("frames", state.frames)
                         .add("leaf", leaf));
    if (i % gesture::kStates != 0) continue;
    int frames = 0;
    for (std::size_t s = i; s < i + gesture::kStates; ++s) frames += performance.states[s].frames;
    states.back().say(fmt::format("{:<8} {:6} {:6}", label, state.start, frames));
  }
  return states;
}

// What is special about the performance of a hand, or of a body.
struct Performed {
  std::string name;  // of the figure in JSON
  double distance_cm = 0.0;
  std::string words;
};

// Applies the hand constraints (unless --unconstrained) and writes the file.
Result<Performed> perform_hand(const SynthOptions& options, perform::Performance& performance) {
  const auto shape = TRY(find_hand_shape(options.shape));
  const double gap_m = options.unconstrained ? perform::smallest_gap_m(performance, *shape)
                                             : perform::constrain(performance, *shape).min_gap_m;
  clip::HandClip hand;
  hand.side = side_named(options.hand);
  hand.rate_hz = performance.rate_hz;
  for (std::size_t t = 0; t < performance.angles.size(); ++t) {
    hand.angles.push_back(perform::hand_of(performance.angles[t]));
    hand.time_s.push_back(static_cast<double>(t) / performance.rate_hz);
  }
  TRY(write_hand(hand, options));
  const double gap_cm = 100.0 * gap_m;
  return Performed{"min_gap_cm", gap_cm,
                   fmt::format("fingers {} {:.2f} cm {}", gap_cm < 0.0 ? "overlap by" : "at least",
                               std::abs(gap_cm), gap_cm < 0.0 ? "at worst" : "apart")};
}

// Writes a body's performance.
Result<Performed> perform_body(const SynthOptions& options, const gesture::GestureModel& model,
                               const perform::Performance& performance) {
  if (options.body.empty() || clip::format_of(options.out)->is_hand) {
    return misuse(
        "the model is of a body; name a clip of the body that performs and a BVH to "
        "write: --body TAKE.bvh --out OUT.bvh",
        options.model);
  }
  const auto body = TRY(clip::read_clip(options.body));
  const auto performed = TRY(perform::perform_on(model, performance, body));
  TRY(clip::write_clip(performed.clip, options.out));
  const double off_cm = 100.0 * performed.feet_off_m;
  return Performed{"feet_off_cm", off_cm,
                   fmt::format("feet within {:.1f} cm of their places", off_cm)};
}

Result<Findings> synth(const SynthOptions& options) {
  TRY(OutputFiles(options.overwrite)
          .reads(options.model)
          .reads(options.body)
          .writes(options.out, clip::extensions(clip::Use::kWrite))
          .check());
  const auto perform_as = TRY(perform_options(options));
  auto model = TRY(gesture::load_model(options.model));
  if (model.is_hand() && !options.body.empty()) {
    return misuse("the model is of hands; leave out --body", options.model);
  }
  const auto labels = TRY(perform::labels_of(model, options.labels));
  const double rate_hz = model.rate_hz;
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(std::move(model)), rate_hz);
  auto performance = TRY(perform::perform(information, labels, perform_as));
  const auto performed =
      TRY(information.model().is_hand() ? perform_hand(options, performance)
                                        : perform_body(options, information.model(), performance));
  const std::size_t frames = performance.angles.size();
  return Findings()
      .add("frames", frames)
      .add("rate_hz", rate_hz)
      .say(fmt::format("{:<8} {:>6} {:>6}", "label", "start", "frames"))
      .add("states", findings_of(information.model(), performance))
      .add(performed.name, performed.distance_cm)
      .add("out", options.out)
      .say(fmt::format("{} frames at {:g} Hz, {}, written to {}", frames, rate_hz, performed.words,
                       options.out));
}

}  // namespace

void add_synth(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("synth", "Let a hand or a body perform a string of labels");
  command->footer(kSynthFooter);
  const auto options = std::make_shared<SynthOptions>();
  command->add_option("--model", options->model, "Model from `posed train gesture`")->required();
  command->add_option("--labels", options->labels, "Labels with blanks between")->required();
  command->add_option("--tempo", options->tempo, "2 is twice as fast")
      ->check(in_range(gesture::kMinTempo, gesture::kMaxTempo))
      ->capture_default_str();
  command
      ->add_option("--lookahead", options->lookahead, "Frames that are known in advance, or full")
      ->capture_default_str();
  command->add_option("--hand", options->hand, "left or right")
      ->check(CLI::IsMember({"left", "right"}))
      ->capture_default_str();
  command
      ->add_option("--hand-shape", options->shape,
                   "Hand whose bone lengths are used for collisions and the BVH")
      ->capture_default_str();
  command->add_option("--body", options->body,
                      "With a body's model: a clip of the body that performs (BVH, AMC)");
  command->add_flag("--global-variance", options->global_variance,
                    "Restore the range of motion that averaging reduces");
  command->add_flag("--unconstrained", options->unconstrained,
                    "Leave out joint limits and collisions: the model's bare trajectory");
  command->add_option("--out", options->out, "To write: " + clip::listed(clip::Use::kWrite))
      ->required();
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, &exit_code] {
    const auto made = [&] {
      const Waiting waiting("performing");
      return synth(*options);
    }();
    exit_code = made ? made->show(options->json) : report(made.error());
  });
}

}  // namespace posed::tools
