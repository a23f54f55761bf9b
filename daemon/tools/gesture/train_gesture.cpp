#include "daemon/tools/gesture/train_gesture.hpp"

#include <cstdio>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/hand_option.hpp"
#include "daemon/tools/command/number_range.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/gesture/auto_label.hpp"
#include "daemon/tools/gesture/gesture_data.hpp"
#include "daemon/tools/gesture/gesture_figures.hpp"
#include "daemon/tools/gesture/gesture_report.hpp"
#include "daemon/tools/gesture/tree_options.hpp"
#include "models/fixed_products.hpp"
#include "models/gesture/model_file.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

using nlohmann::json;

constexpr const char* kTrainGestureFooter = R"(Examples:
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture
  posed train gesture --clip a.csv b.csv --labels a.lab b.lab --questions mine.toml --out h.gesture
  posed train gesture --clip take1.csv --labels take1.lab --show ok=ok_pose.csv --out h.gesture
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture \
      --tree-svg tree.svg --trees middle:4
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture --report hand.html
  posed train gesture --clip left.bvh right.bvh --labels left.lab right.lab \
      --questions config/gestures/raise-arms.toml --out body.gesture

A label file has a line per gesture, `start end name`, in seconds from the first frame (or HTK's
100 ns). Label two gestures of each name by hand and let posed propose the rest:
  posed train gesture --auto-label --clip take1.csv --labels few.lab --out take1.lab

A body's questions file says which joints stand together as a finger's do; --body takes groups and
classes from the clips. A take of one movement, from rest and back to it, labels itself:
  posed train gesture --auto-label --movement raise-left --body --clip left.bvh --out left.lab)";

struct TrainGestureOptions : GestureSources {
  std::string out, report;
  std::string hand;                             // which of two hands in a clip
  std::string movement, resting{kDefaultRest};  // of a take that labels itself
  int embedded_rounds = 0;
  bool auto_label = false, cycles = false, none = false;
  bool overwrite = false, json = false;
  std::shared_ptr<TreeOptions> trees = std::make_shared<TreeOptions>();
};

constexpr int kWide = 10;  // letters of a column

// --auto-label trains nothing, so options about the training are refused.
Result<> check_auto_label(const TrainGestureOptions& options) {
  if (options.clips.size() != 1 || options.labels.size() > 1) {
    return misuse("--auto-label proposes labels for one clip at a time");
  }
  if (options.movement.empty() == options.labels.empty()) {
    return misuse(
        "--auto-label takes examples of all labels from --labels, or names a take's one movement "
        "with --movement");
  }
  if (options.movement.empty() && options.cycles) {
    return misuse("--cycles cuts a take of one movement; name it: --movement");
  }
  if (options.movement.empty() && options.body) {
    return misuse("--auto-label from examples is for hands; name the take's movement: --movement");
  }
  const bool draws =
      !options.trees->text.empty() || !options.trees->dot.empty() || !options.trees->svg.empty();
  if (draws || !options.report.empty() || !options.questions.empty() || !options.propose.empty() ||
      !options.shows.empty() || options.embedded_rounds > 0 || options.none) {
    return misuse(
        "--auto-label only proposes labels; leave out --questions, --propose-questions, --show, "
        "--embedded-rounds, --none, --tree-... and --report");
  }
  return {};
}

// Every file that is read.
std::vector<std::filesystem::path> inputs_of(const TrainGestureOptions& options) {
  std::vector<std::filesystem::path> inputs(options.clips.begin(), options.clips.end());
  inputs.insert(inputs.end(), options.labels.begin(), options.labels.end());
  if (!options.questions.empty()) inputs.emplace_back(options.questions);
  for (const std::string& show : options.shows) {
    inputs.emplace_back(show.substr(show.find('=') + 1));
  }
  return inputs;
}

Result<> check(const TrainGestureOptions& options) {
  if (options.auto_label) {
    if (auto useful = check_auto_label(options); !useful) return useful;
  } else if (!options.movement.empty()) {
    return misuse("--movement labels a take; add --auto-label");
  } else if (options.cycles) {
    return misuse("--cycles says how --auto-label cuts a take of one --movement; add both");
  } else if (options.clips.size() != options.labels.size()) {
    return misuse("name one label file for each clip: --clip A.csv B.csv --labels A.lab B.lab");
  }
  if (!options.questions.empty() && !options.propose.empty()) {
    return misuse("--propose-questions makes the classes that --questions reads; name one of them");
  }
  OutputFiles files(options.overwrite);
  const auto groups = groups_of(options);
  if (!groups) return std::unexpected(groups.error());
  if (auto trees = check_tree_options(*options.trees, files, *groups); !trees) return trees;
  files.reads_all(inputs_of(options));
  if (options.auto_label) {
    return files.writes_any_but_other(options.out, {".lab"}).check();
  }
  return files.writes_any_but_other(options.propose, {".toml"})
      .writes_any_but_other(options.out, {".gesture"})
      .writes(options.report, {".html"})
      .check();
}

void print_gesture_summary(const json& report, const TrainGestureOptions& options) {
  std::printf("%d gestures, %d frames, %d contexts, %d moving channels; leaves a state:\n",
              report["gestures"].get<int>(), report["frames"].get<int>(),
              report["contexts"].get<int>(), report["moving_channels"].get<int>());
  const auto& groups = report["groups"];
  std::printf("%-8s", "state");
  for (const json& group : groups) std::printf("%*s", kWide, group.get<std::string>().c_str());
  for (const json& state : report["leaves_by_state"]) {
    std::printf("\n%-8d", state["state"].get<int>());
    for (const json& group : groups) {
      std::printf("%*d", kWide, state[group.get<std::string>()].get<int>());
    }
  }
  std::printf("\n%d leaves in %zu trees, %d of durations\n", report["leaves"].get<int>(),
              gesture::kStates * groups.size(), report["duration_leaves"].get<int>());
  std::string labels;
  for (const json& label : report["labels"]) labels += " " + label["name"].get<std::string>();
  std::printf("%s written after %.2f s; try: posed synth --model %s --labels \"%s\" --out %s\n",
              options.out.c_str(), report["seconds"].get<double>(), options.out.c_str(),
              labels.substr(1).c_str(),
              report["body"].get<bool>() ? "body.bvh --body A_CLIP.bvh" : "hand.csv");
}

Result<json> train_gesture(const TrainGestureOptions& options, Ranks& ranks) {
  auto data = read_gesture_data(options, ranks.leads());
  if (!data) return std::unexpected(data.error());
  const std::vector<gesture::Recording>& recordings = data->recordings;
  if (options.none && !data->vocabulary.is_hand()) {
    return misuse("a live body is always told what is none of its gestures; leave out --none");
  }
  gesture::TrainOptions train_options;
  train_options.vocabulary = std::move(data->vocabulary);
  train_options.vocabulary.tells_none = options.none;
  train_options.embedded_rounds = options.embedded_rounds;
  auto training = train_gesture_and_save(recordings, std::move(train_options), options.out, ranks);
  if (!training) return std::unexpected(training.error());
  const auto drawn = ranks.leads() ? draw_trees(training->model, *options.trees) : Result<>{};
  if (!drawn) return std::unexpected(drawn.error());
  json report = json::parse(training->model.report_json);
  report["seconds"] = training->seconds;
  report["out"] = options.out;
  report["body"] = !training->model.is_hand();
  for (const auto& group : training->model.groups) report["groups"].push_back(group.name);
  const std::size_t warnings = report["warnings"].size();
  report["verdict"] = warnings == 0 ? "good: these recordings show no problem with the model"
                                    : "usable with care: " + std::to_string(warnings) +
                                          " warnings above say what to record more of";
  if (!options.report.empty() && ranks.leads()) {
    auto body = figure_of(training->model, options.clips.front(), options.read);
    if (!body) return std::unexpected(body.error());
    const auto model = std::make_shared<const gesture::GestureModel>(std::move(training->model));
    const auto written = write_gesture_report({.title = "Training of gestures",
                                               .command = "posed train gesture",
                                               .recorded_by = "the training recordings",
                                               .labels = labels_to_show(*model),
                                               .good = warnings == 0,
                                               .body = std::move(*body)},
                                              model, recordings, report, options.report);
    if (!written) return std::unexpected(written.error());
  }
  return report;
}

int train_or_report(const TrainGestureOptions& options, Ranks& ranks) {
  if (ranks.leads()) {
    if (auto checked = check(options); !checked) return report(checked.error());
  }
  if (options.auto_label) {
    if (!ranks.leads()) return 0;  // there is nothing to share, so nothing has to be the same
    return auto_label({.clip = options.clips[0],
                       .examples = options.labels.empty() ? "" : options.labels[0],
                       .out = options.out,
                       .movement = options.movement,
                       .rest = options.resting,
                       .body = options.body,
                       .cycles = options.cycles,
                       .rate_hz = options.rate_hz,
                       .read = options.read,
                       .json = options.json});
  }
  if (auto same = ranks.check_same(inputs_of(options)); !same) return report(same.error());
  const auto trained = train_gesture(options, ranks);
  if (!trained) return report(trained.error());
  for (const json& warning : (*trained)["warnings"]) {
    std::fprintf(stderr, "posed: warning: %s\n", warning.get<std::string>().c_str());
  }
  if (options.json) {
    std::printf("%s\n", json_text(*trained, 2).c_str());
  } else {
    print_gesture_summary(*trained, options);
  }
  std::fflush(stdout);
  std::fprintf(stderr, "posed: %s\n", (*trained)["verdict"].get<std::string>().c_str());
  return 0;
}

}  // namespace

Result<GestureTraining> train_gesture_and_save(const std::vector<gesture::Recording>& recordings,
                                               gesture::TrainOptions options,
                                               const std::filesystem::path& out, Ranks& ranks) {
  const FixedProducts fixed;
  ProgressBar bar;
  options.tasks = &ranks.tasks();
  options.progress = [&bar](std::string_view step, double fraction) {
    return bar.show(step, fraction);
  };
  auto model = gesture::train_gesture(recordings, options);
  if (!model) return std::unexpected(model.error());
  const double seconds = bar.elapsed_s();
  const auto saved = ranks.write_model([&] { return gesture::save_model(*model, out); });
  if (!saved) return std::unexpected(saved.error());
  return GestureTraining{std::move(*model), seconds};
}

void add_train_gesture(CLI::App& train_command, int& exit_code,
                       const std::shared_ptr<Ranks>& ranks) {
  CLI::App* command =
      train_command.add_subcommand("gesture", "Learn gestures from labelled recordings");
  command->footer(kTrainGestureFooter);
  const auto options = std::make_shared<TrainGestureOptions>();
  command
      ->add_option("--clip", options->clips,
                   "Recordings of a hand (CSV, or BVH with fingers) or a body (BVH, AMC)")
      ->required();
  command->add_option("--labels", options->labels, "Their label files, in the same order");
  command->add_option("--questions", options->questions,
                      "TOML file of the classes of fingers, or of groups of a body's joints; "
                      "without it the set g c p 1 3 4");
  command->add_option("--hand", options->hand, "left or right, where a clip has both")
      ->check(CLI::IsMember({"left", "right"}));
  command->add_flag("--body", options->body,
                    "The clips are of a body; groups and classes are proposed from them");
  command->add_option("--propose-questions", options->propose,
                      "Sort the recorded gestures into classes, write them here and use them");
  command->add_option("--show", options->shows,
                      "NAME=POSE.csv: a gesture not recorded, classes from the nearest poses");
  command->add_option("--rate", options->rate_hz, "Frames per second to learn at")
      ->check(in_range(10.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--embedded-rounds", options->embedded_rounds,
                   "Rounds in which borders may move, for coarse labels")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_flag("--auto-label", options->auto_label,
                    "Train nothing: propose labels from few examples and write them to --out");
  command->add_option(
      "--movement", options->movement,
      "With --auto-label: the take is one movement of this name, from rest to rest");
  command->add_option("--rest", options->resting, "The label of its rest")->capture_default_str();
  command->add_flag(
      "--cycles", options->cycles,
      "Cut its hold at each cycle, so that a wave is performed as often as one likes");
  command->add_flag("--none", options->none,
                    "Tell a live hand that makes none of the gestures so, as a body always is");
  add_tree_options(*command, options->trees);
  command->add_option("--out", options->out, "Where to write the model")->required();
  add_report_option(*command, options->report);
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback([options, ranks, &exit_code] {
    if (!options->hand.empty()) options->read.hand = side_named(options->hand);
    exit_code = train_or_report(*options, *ranks);
  });
}

}  // namespace posed::tools
