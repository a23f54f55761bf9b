#include "daemon/tools/gesture/train_gesture.hpp"

#include <memory>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/person_clip.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/gesture/gesture_data.hpp"
#include "daemon/tools/gesture/gesture_report.hpp"
#include "daemon/tools/gesture/tree_options.hpp"
#include "models/fixed_products.hpp"
#include "models/gesture/auto_label.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/movement_label.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

constexpr const char* kDefaultRest = "rest";

struct AutoLabelOptions {
  std::filesystem::path clip, examples, out;
  std::string movement, rest;  // of a take without examples
  bool body;                   // such a take is of a body
  bool cycles;                 // its hold is cut so that it can be repeated
  double rate_hz;
  clip::ReadOptions read;
  bool json;
};

// `posed train gesture --auto-label`: proposes labels for a recording of which few parts are
// labelled, or which is a single movement. Returns the exit code; prints results on stdout and
// errors on stderr.
int auto_label(const AutoLabelOptions& options) {
  const bool one_movement = !options.movement.empty();
  const auto recording =
      one_movement ? load_unlabelled(options.clip, options.body, options.rate_hz, options.read)
                   : load_recording(options.clip, options.examples, options.rate_hz, options.read);
  if (!recording) return report(recording.error());
  const auto proposed = [&] {
    const Waiting waiting("proposing labels");
    if (!one_movement) return gesture::propose_segments(*recording);
    const auto hold = options.cycles ? gesture::Hold::kCycles : gesture::Hold::kWhole;
    return gesture::propose_movement(*recording, options.movement, options.rest, hold);
  }();
  if (!proposed) return report(proposed.error());
  std::vector<clip::LabelSegment> labels;
  for (const gesture::Segment& segment : *proposed) {
    labels.push_back({segment.begin / options.rate_hz, segment.end / options.rate_hz, segment.label,
                      static_cast<int>(labels.size()) + 1});
  }
  if (auto written = clip::write_labels(labels, options.out); !written) {
    return report(written.error());
  }
  const std::size_t examples = recording->segments.size();
  Findings findings;
  findings.add("examples", examples)
      .add("segments", labels.size())
      .add("out", options.out.string())
      .say(one_movement
               ? fmt::format("{} segments proposed, written to {}; look through them",
                             labels.size(), options.out.string())
               : fmt::format("{} segments proposed from {} examples, written to {}; look through "
                             "them, two gestures of one name in a row look like one",
                             labels.size(), examples, options.out.string()));
  return findings.show(options.json);
}

constexpr const char* kTrainGestureFooter = R"(Examples:
  posed train gesture --clip take1.csv --labels take1.lab --out hand.gesture
  posed train gesture --clip a.csv b.csv --labels a.lab b.lab --questions mine.toml --out h.gesture
  posed train gesture --clip take1.csv --labels take1.lab --show ok=ok_pose.csv --out h.gesture
  posed train gesture --none --clip ann:a.csv bob:b.csv --labels a.lab b.lab --out hand.gesture
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

constexpr int kWide = 10;       // letters of a column
constexpr int kFewPeople = 10;  // fewer do not show how much people differ

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
    TRY(check_auto_label(options));
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
  const auto groups = TRY(groups_of(options));
  TRY(check_tree_options(*options.trees, files, groups));
  files.reads_all(inputs_of(options));
  if (options.auto_label) {
    return files.writes_any_but_other(options.out, {".lab"}).check();
  }
  return files.writes_any_but_other(options.propose, {".toml"})
      .writes_any_but_other(options.out, {".gesture"})
      .writes(options.report, {".html"})
      .check();
}

// A row of leaves for each state, and what was learnt from.
void add_summary(const GestureTraining& training, const std::vector<gesture::Recording>& recordings,
                 const std::string& out, Findings& findings) {
  const gesture::GestureModel& model = training.model;
  std::size_t gestures = 0;
  Eigen::Index frames = 0;
  for (const gesture::Recording& recording : recordings) {
    gestures += recording.segments.size();
    frames += recording.angles_rad.rows();
  }
  findings.say(fmt::format(
      "{} gestures, {} frames, {} contexts, {} moving channels; leaves a state:", gestures, frames,
      training.findings.contexts, training.findings.moving_channels));
  std::string line = fmt::format("{:<8}", "state");
  for (const auto& group : model.groups) line += fmt::format("{:>{}}", group.name, kWide);
  findings.say(line);
  std::size_t leaves = 0;
  for (std::size_t state = 0; state < model.trees.size(); ++state) {
    line = fmt::format("{:<8}", state + 1);
    for (const auto& tree : model.trees[state]) {
      line += fmt::format("{:{}}", tree.leaves.size(), kWide);
      leaves += tree.leaves.size();
    }
    findings.say(line);
  }
  const std::string labels = joined(model.labels, " ", &gesture::Label::name);
  findings
      .say(fmt::format("{} leaves in {} trees, {} of durations", leaves,
                       gesture::kStates * model.groups.size(), model.durations.leaves.size()))
      .say(fmt::format(
          "{0} written after {1:.2f} s; try: posed synth --model {0} --labels \"{2}\" --out {3}",
          out, training.seconds, labels,
          model.is_hand() ? "hand.csv" : "body.bvh --body A_CLIP.bvh"));
}

// Whom the model may be trusted with.
std::string none_words(const gesture::HeldPoses& held) {
  if (held.people == 1) {
    return "'none' was tried on takes of one person, and a stranger's gestures may be none; name "
           "the people of the clips, PERSON:FILE";
  }
  return fmt::format(
      "'none' was tried on {} people, each left out of training once{}", held.people,
      held.people < kFewPeople ? "; of so few, a stranger's gestures may be none" : "");
}

Result<Findings> train_gesture(const TrainGestureOptions& options, Ranks& ranks) {
  auto data = TRY(read_gesture_data(options, ranks.leads()));
  const std::vector<gesture::Recording>& recordings = data.recordings;
  if (options.none && !data.vocabulary.is_hand()) {
    return misuse("a live body is always told what is none of its gestures; leave out --none");
  }
  gesture::TrainOptions train_options;
  train_options.vocabulary = std::move(data.vocabulary);
  train_options.vocabulary.tells_none = options.none;
  train_options.embedded_rounds = options.embedded_rounds;
  auto training =
      TRY(train_gesture_and_save(recordings, std::move(train_options), options.out, ranks));
  TRY(ranks.leads() ? draw_trees(training.model, *options.trees) : Result<>{});
  const std::vector<std::string>& warnings = training.findings.warnings;
  const std::string verdict = warnings.empty()
                                  ? "good: these recordings show no problem with the model"
                                  : fmt::format(
                                        "usable with care: {} warnings above say what to "
                                        "record more of",
                                        warnings.size());
  std::vector<std::string> groups;
  for (const auto& group : training.model.groups) groups.push_back(group.name);
  Findings findings;
  findings.add_json(training.model.report_json)
      .add("seconds", training.seconds)
      .add("out", options.out)
      .add("body", !training.model.is_hand())
      .add("groups", groups)
      .add("verdict", verdict);
  add_summary(training, recordings, options.out, findings);
  if (training.model.held) {
    findings.add("people", training.model.held->people).remark(none_words(*training.model.held));
  }
  findings.warn(warnings).remark(verdict);
  if (!options.report.empty() && ranks.leads()) {
    auto body = TRY(figure_of(training.model, options.clips.front(), options.read));
    const auto model = std::make_shared<const gesture::GestureModel>(std::move(training.model));
    TRY(write_gesture_report({.title = "Training of gestures",
                              .command = "posed train gesture",
                              .recorded_by = "the training recordings",
                              .labels = labels_to_show(*model),
                              .verdict = verdict,
                              .good = warnings.empty(),
                              .warnings = warnings,
                              .body = std::move(body)},
                             model, recordings, findings, options.report));
  }
  return findings;
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
  return trained->show(options.json);
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
  gesture::TrainFindings found;
  options.look = [&found](gesture::TrainFindings findings) { found = std::move(findings); };
  auto model = TRY(gesture::train_gesture(recordings, options));
  const double seconds = bar.elapsed_s();
  TRY(ranks.write_model([&] { return gesture::save_model(model, out); }));
  return GestureTraining{std::move(model), std::move(found), seconds};
}

void add_train_gesture(CLI::App& train_command, int& exit_code,
                       const std::shared_ptr<Ranks>& ranks) {
  CLI::App* command =
      train_command.add_subcommand("gesture", "Learn gestures from labelled recordings");
  command->footer(kTrainGestureFooter);
  const auto options = std::make_shared<TrainGestureOptions>();
  command
      ->add_option("--clip", options->clips,
                   "Recordings of a hand (CSV, or BVH with fingers) or a body (BVH, AMC): "
                   "[PERSON:]FILE")
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
    for (std::string& clip : options->clips) {
      auto [person, file] = person_clip(clip);
      options->people.push_back(std::move(person));
      clip = std::move(file);
    }
    if (!options->hand.empty()) options->read.hand = side_named(options->hand);
    exit_code = train_or_report(*options, *ranks);
  });
}

}  // namespace posed::tools
