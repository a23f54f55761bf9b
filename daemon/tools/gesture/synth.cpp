// `posed synth`: performs a sequence of labels with a hand or a body and writes a file.
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/hand_option.hpp"
#include "daemon/tools/command/number_range.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/waiting.hpp"
#include "models/gesture/model_file.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/constrain.hpp"
#include "models/perform/perform.hpp"
#include "models/perform/state_duration.hpp"
#include "proto/clip/bvh.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

using nlohmann::json;

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
  int frames = -1;
  const auto& text = options.lookahead;
  const auto end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, frames);
  constexpr int kMaxFrames = 100'000;
  if (error != std::errc{} || stop != end || frames < 0 || frames > kMaxFrames) {
    return misuse("--lookahead is a number of frames or full, not '" + text + "'");
  }
  perform.look_ahead = frames;
  return perform;
}

Result<> write_hand(const clip::HandClip& hand, const SynthOptions& options) {
  const auto clip = clip::clip_of_hand(hand, options.shape);
  if (!clip) return std::unexpected(clip.error());
  return clip::write_clip(*clip, options.out);
}

json states_json(const gesture::GestureModel& model, const perform::Performance& performance) {
  json states = json::array();
  for (const perform::PerformedState& state : performance.states) {
    json leaf;
    for (std::size_t g = 0; g < model.groups.size(); ++g) {
      leaf[model.groups[g].name] = state.leaf[g];
    }
    states.push_back({{"label", model.labels[state.context.current].name},
                      {"state", state.state + 1},
                      {"start", state.start},
                      {"frames", state.frames},
                      {"leaf", leaf}});
  }
  return states;
}

// Constrains a hand's performance, unless it shall not, and writes it; what is to be told of it.
Result<json> perform_hand(const SynthOptions& options, perform::Performance& performance) {
  const auto shape = find_hand_shape(options.shape);
  if (!shape) return std::unexpected(shape.error());
  const double gap_m = options.unconstrained ? perform::smallest_gap_m(performance, **shape)
                                             : perform::constrain(performance, **shape).min_gap_m;
  clip::HandClip hand;
  hand.side = side_named(options.hand);
  hand.rate_hz = performance.rate_hz;
  for (std::size_t t = 0; t < performance.angles.size(); ++t) {
    hand.angles.push_back(perform::hand_of(performance.angles[t]));
    hand.time_s.push_back(static_cast<double>(t) / performance.rate_hz);
  }
  if (auto written = write_hand(hand, options); !written) return std::unexpected(written.error());
  return json{{"min_gap_cm", 100.0 * gap_m}};
}

// Writes a body's performance.
Result<json> perform_body(const SynthOptions& options, const gesture::GestureModel& model,
                          const perform::Performance& performance) {
  if (options.body.empty() || clip::format_of(options.out)->is_hand) {
    return misuse(
        "the model is of a body; name a clip of the body that performs and a BVH to "
        "write: --body TAKE.bvh --out OUT.bvh",
        options.model);
  }
  const auto body = clip::read_clip(options.body);
  if (!body) return std::unexpected(body.error());
  const auto performed = perform::perform_on(model, performance, *body);
  if (!performed) return std::unexpected(performed.error());
  if (auto written = clip::write_clip(performed->clip, options.out); !written) {
    return std::unexpected(written.error());
  }
  return json{{"feet_off_cm", 100.0 * performed->feet_off_m}};
}

Result<json> synth(const SynthOptions& options) {
  const auto files = OutputFiles(options.overwrite)
                         .reads(options.model)
                         .reads(options.body)
                         .writes(options.out, clip::extensions(clip::Use::kWrite))
                         .check();
  if (!files) return std::unexpected(files.error());
  const auto perform_as = perform_options(options);
  if (!perform_as) return std::unexpected(perform_as.error());
  auto model = gesture::load_model(options.model);
  if (!model) return std::unexpected(model.error());
  if (model->is_hand() && !options.body.empty()) {
    return misuse("the model is of hands; leave out --body", options.model);
  }
  const auto labels = perform::labels_of(*model, options.labels);
  if (!labels) return std::unexpected(labels.error());
  const double rate_hz = model->rate_hz;
  const trajectory::StateInformation information(
      std::make_shared<const gesture::GestureModel>(std::move(*model)), rate_hz);
  auto performance = perform::perform(information, *labels, *perform_as);
  auto report = information.model().is_hand()
                    ? perform_hand(options, performance)
                    : perform_body(options, information.model(), performance);
  if (!report) return report;
  report->update({{"frames", performance.angles.size()},
                  {"rate_hz", rate_hz},
                  {"states", states_json(information.model(), performance)},
                  {"out", options.out}});
  return report;
}

void print_summary(const json& report) {
  std::printf("%-8s %6s %6s\n", "label", "start", "frames");
  for (std::size_t i = 0; i < report["states"].size(); i += gesture::kStates) {
    int frames = 0;
    for (std::size_t s = i; s < i + gesture::kStates; ++s) {
      frames += report["states"][s]["frames"].get<int>();
    }
    const json& first = report["states"][i];
    std::printf("%-8s %6d %6d\n", first["label"].get<std::string>().c_str(),
                first["start"].get<int>(), frames);
  }
  if (report.contains("feet_off_cm")) {
    std::printf("%d frames at %g Hz, feet within %.1f cm of their places, written to %s\n",
                report["frames"].get<int>(), report["rate_hz"].get<double>(),
                report["feet_off_cm"].get<double>(), report["out"].get<std::string>().c_str());
    return;
  }
  const double gap_cm = report["min_gap_cm"].get<double>();
  std::printf("%d frames at %g Hz, fingers %s %.2f cm %s, written to %s\n",
              report["frames"].get<int>(), report["rate_hz"].get<double>(),
              gap_cm < 0.0 ? "overlap by" : "at least", std::abs(gap_cm),
              gap_cm < 0.0 ? "at worst" : "apart", report["out"].get<std::string>().c_str());
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
      ->check(in_range(perform::kMinTempo, perform::kMaxTempo))
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
    if (!made) {
      exit_code = report(made.error());
    } else if (options->json) {
      std::printf("%s\n", json_text(*made, 2).c_str());
    } else {
      print_summary(*made);
    }
  });
}

}  // namespace posed::tools
