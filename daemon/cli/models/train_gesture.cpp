#include "daemon/cli/models/train_gesture.hpp"

#include <cstdio>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/hand_option.hpp"
#include "daemon/cli/models/auto_label.hpp"
#include "daemon/cli/models/gesture_figures.hpp"
#include "daemon/cli/models/gesture_report.hpp"
#include "daemon/cli/models/question_file.hpp"
#include "daemon/cli/models/tree_options.hpp"
#include "daemon/cli/output_files.hpp"
#include "daemon/cli/progress.hpp"
#include "models/fixed_products.hpp"
#include "models/gesture/model_file.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/label.hpp"

namespace posed::cli {
namespace {

using nlohmann::json;

constexpr const char* kTrainGestureFooter = R"(Examples:
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture
  posed train gesture --clip a.csv b.csv --labels a.lab b.lab --questions mine.toml --out h.gesture
  posed train gesture --clip take1.csv --labels take1.lab --show ok=ok_pose.csv --out h.gesture
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture \
      --tree-svg tree.svg --trees middle:4
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture --report hand.html

A label file has a line per gesture, `start end name`, in seconds from the first frame (or HTK's
100 ns). Label two gestures of each name by hand and let posed propose the rest:
  posed train gesture --auto-label --clip take1.csv --labels few.lab --out take1.lab)";

struct TrainGestureOptions {
  std::vector<std::string> clips, labels, shows;
  std::string questions, propose, out, report;
  std::string hand;  // which hand of a body
  double rate_hz = 30.0;
  int embedded_rounds = 0;
  bool auto_label = false;
  bool overwrite = false, json = false;
  std::shared_ptr<TreeOptions> trees = std::make_shared<TreeOptions>();
};

// --auto-label trains nothing, so options about the training are refused.
Result<> check_auto_label(const TrainGestureOptions& options) {
  if (options.clips.size() != 1) {
    return misuse("--auto-label proposes labels for one clip at a time");
  }
  const bool draws =
      !options.trees->text.empty() || !options.trees->dot.empty() || !options.trees->svg.empty();
  if (draws || !options.report.empty() || !options.questions.empty() || !options.propose.empty() ||
      !options.shows.empty() || options.embedded_rounds > 0) {
    return misuse(
        "--auto-label only proposes labels; leave out --questions, --propose-questions, --show, "
        "--embedded-rounds, --tree-... and --report");
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
  if (options.clips.size() != options.labels.size()) {
    return misuse("name one label file for each clip: --clip A.csv B.csv --labels A.lab B.lab");
  }
  if (!options.questions.empty() && !options.propose.empty()) {
    return misuse("--propose-questions makes the classes that --questions reads; name one of them");
  }
  OutputFiles files(options.overwrite);
  if (auto trees = check_tree_options(*options.trees, files); !trees) return trees;
  files.reads_all(inputs_of(options));
  if (options.auto_label) {
    if (auto useful = check_auto_label(options); !useful) return useful;
    return files.writes_any_but_other(options.out, {".lab"}).check();
  }
  return files.writes_any_but_other(options.propose, {".toml"})
      .writes_any_but_other(options.out, {".gesture"})
      .writes(options.report, {".html"})
      .check();
}

clip::ReadOptions read_options(const std::string& hand) {
  clip::ReadOptions read;
  if (!hand.empty()) read.hand = side_named(hand);
  return read;
}

// "ok=ok_pose.csv": the pose is the mean of the clip.
Result<gesture::LabelPose> shown_pose(const std::string& show, const TrainGestureOptions& options) {
  const auto equals = show.find('=');
  if (equals == std::string::npos || !is_label_name(std::string_view(show).substr(0, equals))) {
    return misuse("'" + show +
                  "' shows no pose; write --show NAME=POSE.csv, NAME of 1 to 15 signs");
  }
  const auto clip = clip::read_hand_clip(show.substr(equals + 1), read_options(options.hand));
  if (!clip) return std::unexpected(clip.error());
  const auto recording = gesture::recording_of(*clip, options.rate_hz);
  if (!recording) return std::unexpected(recording.error());
  gesture::LabelPose pose{show.substr(0, equals), {}};
  const Eigen::RowVectorXd mean = recording->angles_rad.colwise().mean();
  std::copy(mean.begin(), mean.end(), pose.angles_rad.begin());
  return pose;
}

// The classes of all labels: from the file, proposed, or built in; then the poses given by clips.
Result<std::vector<gesture::Label>> classes(const TrainGestureOptions& options,
                                            const std::vector<gesture::Recording>& recordings,
                                            const Ranks& ranks) {
  std::vector<gesture::Label> labels = gesture::built_in_labels();
  const auto poses = gesture::label_poses(recordings);
  if (!options.questions.empty()) {
    auto read = read_questions(options.questions);
    if (!read) return read;
    labels = std::move(*read);
  } else if (!options.propose.empty()) {
    labels = gesture::propose_labels(poses);
    const auto written = ranks.leads() ? write_questions(labels, options.propose) : Result<>{};
    if (!written) return std::unexpected(written.error());
  }
  for (const std::string& show : options.shows) {
    const auto shown = shown_pose(show, options);
    if (!shown) return std::unexpected(shown.error());
    const gesture::Label label = gesture::label_like(*shown, poses, labels);
    std::erase_if(labels, [&](const gesture::Label& known) { return known.name == label.name; });
    labels.push_back(label);
  }
  return labels;
}

void print_gesture_summary(const json& report, const std::string& out) {
  std::printf("%d gestures, %d frames, %d contexts, %d moving channels; leaves a state:\n",
              report["gestures"].get<int>(), report["frames"].get<int>(),
              report["contexts"].get<int>(), report["moving_channels"].get<int>());
  std::printf("%-8s", "state");
  for (const auto finger : kFingerNames) std::printf("%8s", std::string(finger).c_str());
  for (const json& state : report["leaves_by_state"]) {
    std::printf("\n%-8d", state["state"].get<int>());
    for (const auto finger : kFingerNames) {
      std::printf("%8d", state[std::string(finger)].get<int>());
    }
  }
  std::printf("\n%d leaves in 25 trees, %d of durations\n", report["leaves"].get<int>(),
              report["duration_leaves"].get<int>());
  std::printf(
      "%s written after %.2f s; try: posed synth --model %s --labels \"g 1 c 3 4 p\" "
      "--out hand.csv\n",
      out.c_str(), report["seconds"].get<double>(), out.c_str());
}

Result<json> train_gesture(const TrainGestureOptions& options, Ranks& ranks) {
  std::vector<gesture::Recording> recordings;
  for (std::size_t i = 0; i < options.clips.size(); ++i) {
    auto recording = load_recording(options.clips[i], options.labels[i], options.rate_hz,
                                    read_options(options.hand));
    if (!recording) return std::unexpected(recording.error());
    recordings.push_back(std::move(*recording));
  }
  auto labels = classes(options, recordings, ranks);
  if (!labels) return std::unexpected(labels.error());
  gesture::TrainOptions train_options;
  train_options.labels = std::move(*labels);
  train_options.embedded_rounds = options.embedded_rounds;
  auto training = train_gesture_and_save(recordings, std::move(train_options), options.out, ranks);
  if (!training) return std::unexpected(training.error());
  const auto drawn = ranks.leads() ? draw_trees(training->model, *options.trees) : Result<>{};
  if (!drawn) return std::unexpected(drawn.error());
  json report = json::parse(training->model.report_json);
  report["seconds"] = training->seconds;
  report["out"] = options.out;
  const std::size_t warnings = report["warnings"].size();
  report["verdict"] = warnings == 0 ? "good: these recordings show no problem with the model"
                                    : "usable with care: " + std::to_string(warnings) +
                                          " warnings above say what to record more of";
  if (!options.report.empty() && ranks.leads()) {
    const auto model = std::make_shared<const gesture::GestureModel>(std::move(training->model));
    const auto written = write_gesture_report({.title = "Training of gestures",
                                               .command = "posed train gesture",
                                               .recorded_by = "the training recordings",
                                               .labels = labels_to_show(*model),
                                               .good = warnings == 0},
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
    return auto_label({options.clips[0], options.labels[0], options.out, options.rate_hz,
                       read_options(options.hand), options.json});
  }
  if (auto same = ranks.check_same(inputs_of(options)); !same) return report(same.error());
  const auto trained = train_gesture(options, ranks);
  if (!trained) return report(trained.error());
  for (const json& warning : (*trained)["warnings"]) {
    std::fprintf(stderr, "posed: warning: %s\n", warning.get<std::string>().c_str());
  }
  if (options.json) {
    std::printf("%s\n", trained->dump(2).c_str());
  } else {
    print_gesture_summary(*trained, options.out);
  }
  std::fflush(stdout);
  std::fprintf(stderr, "posed: %s\n", (*trained)["verdict"].get<std::string>().c_str());
  return 0;
}

}  // namespace

Result<gesture::Recording> load_recording(const std::filesystem::path& clip,
                                          const std::filesystem::path& labels, double rate_hz,
                                          const clip::ReadOptions& read) {
  const auto hand = clip::read_hand_clip(clip, read);
  if (!hand) return std::unexpected(hand.error());
  for (const std::string& warning : hand->warnings) {
    std::fprintf(stderr, "posed: warning: %s: %s\n", clip.c_str(), warning.c_str());
  }
  auto recording = gesture::recording_of(*hand, rate_hz);
  if (!recording) return std::unexpected(recording.error());
  const auto segments = clip::read_labels(labels);
  if (!segments) return std::unexpected(segments.error());
  if (auto done = gesture::cut(*recording, *segments, labels.string()); !done) {
    return std::unexpected(done.error());
  }
  return recording;
}

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
      train_command.add_subcommand("gesture", "Learn a hand's gestures from labelled recordings");
  command->footer(kTrainGestureFooter);
  const auto options = std::make_shared<TrainGestureOptions>();
  command->add_option("--clip", options->clips, "Hand recordings (CSV, or BVH with fingers)")
      ->required();
  command->add_option("--labels", options->labels, "Their label files, in the same order")
      ->required();
  command->add_option("--questions", options->questions,
                      "TOML file of the fingers' classes; without it the set g c p 1 3 4");
  command->add_option("--propose-questions", options->propose,
                      "Sort the recorded gestures into classes, write them here and use them");
  command->add_option("--show", options->shows,
                      "NAME=POSE.csv: a gesture not recorded, classes from the nearest poses");
  command->add_option("--rate", options->rate_hz, "Frames per second to learn at")
      ->check(CLI::Range(10.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--embedded-rounds", options->embedded_rounds,
                   "Rounds in which borders may move, for coarse labels")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  command->add_flag("--auto-label", options->auto_label,
                    "Train nothing: propose labels from few examples and write them to --out");
  add_tree_options(*command, options->trees);
  command->add_option("--out", options->out, "Where to write the model")->required();
  add_report_option(*command, options->report);
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "One JSON object on stdout");
  command->callback(
      [options, ranks, &exit_code] { exit_code = train_or_report(*options, *ranks); });
}

}  // namespace posed::cli
