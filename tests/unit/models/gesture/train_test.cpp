// Training on synthetic signers, and on recordings from which nothing can be learnt.
#include <catch2/catch.hpp>

#include <limits>

#include <nlohmann/json.hpp>

#include "models/gesture/model_file.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/gesture/train.hpp"
#include "tests/support/backward_tasks.hpp"

using namespace posed;
using namespace posed::gesture;

namespace {

Recording performed(const SignerOptions& options) {
  const auto performance = make_performance(options);
  REQUIRE(performance.has_value());
  auto recording = recording_of(performance->clip, 30.0);
  REQUIRE(recording.has_value());
  REQUIRE(cut(*recording, performance->labels, "synthetic.lab").has_value());
  return *recording;
}

bool warned(const GestureModel& model, const std::string& what) {
  const auto warnings = nlohmann::json::parse(model.report_json)["warnings"];
  UNSCOPED_INFO(warnings);
  return std::ranges::any_of(warnings, [&](const auto& warning) {
    return warning.template get<std::string>().find(what) != std::string::npos;
  });
}

// Whether every number that a lookup can return would be accepted in a model file.
bool valid(const GestureModel& model) {
  const std::string bytes = serialize_model(model);
  const auto parsed = parse_model(std::as_bytes(std::span(bytes)), "trained");
  if (!parsed) UNSCOPED_INFO(parsed.error().message);
  return parsed.has_value();
}

// Counts how often its tasks ask whether to stop, and says so from then on.
class AskedTasks final : public TaskRunner {
 public:
  explicit AskedTasks(int patience) : patience_(patience) {}
  [[nodiscard]] int asked() const { return asked_; }
  [[nodiscard]] bool stopping() const override { return ++asked_ > patience_; }
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override {
    auto results = SerialTasks().run(count, task, progress);
    return asked_ > patience_ ? std::nullopt : std::move(results);
  }

 private:
  int patience_;
  mutable int asked_ = 0;
};

}  // namespace

TEST_CASE("A synthetic signer performs the requested corpus", "[signer]") {
  const auto one = make_performance({});
  const auto again = make_performance({});
  const auto other = make_performance({.person = 2});
  REQUIRE(one.has_value());
  CHECK(one->labels.size() == 100);
  CHECK(one->clip.angles.size() > 5500);
  CHECK(one->clip.angles.size() < 6700);
  CHECK(one->clip.angles == again->clip.angles);
  CHECK_FALSE(one->clip.angles[1000] == other->clip.angles[1000]);
  // Never the same twice in a row, borders touch.
  for (std::size_t i = 1; i < one->labels.size(); ++i) {
    CHECK(one->labels[i].name != one->labels[i - 1].name);
    CHECK(one->labels[i].start_s == one->labels[i - 1].end_s);
  }
  CHECK_FALSE(make_performance({.script = {"g", "what"}}).has_value());
}

TEST_CASE("A synthetic corpus is learnt, unseen labels included", "[train]") {
  const Recording recording = performed({});
  const auto model = train_gesture({recording}, {});
  REQUIRE(model.has_value());
  CHECK(valid(*model));
  CHECK_FALSE(warned(*model, "gestures; below 20"));
  CHECK_FALSE(warned(*model, "may go astray"));
  const auto report = nlohmann::json::parse(model->report_json);
  CHECK(report["gestures"] == 100);
  CHECK(report["moving_channels"] == 19);
  // "1" between g and c: the index as in p, the middle finger as in g.
  const Context context{model->label_index("g"), model->label_index("1"), model->label_index("c")};
  CHECK(leaf(*model, 2, 1, context).mean[0][3] < 0.4);
  CHECK(leaf(*model, 2, 2, context).mean[0][3] > 1.3);
  for (const double frames : duration(*model, context).mean) CHECK(frames > 1.0);
  CHECK(model->labels[model->label_index("g")].trained);
  CHECK_FALSE(model->labels[model->label_index("3")].trained);
}

TEST_CASE("Several recordings make one model", "[train]") {
  const std::vector<Recording> people{performed({.person = 1, .gestures = 30}),
                                      performed({.person = 2, .gestures = 30})};
  const auto model = train_gesture(people, {});
  REQUIRE(model.has_value());
  CHECK(nlohmann::json::parse(model->report_json)["gestures"] == 60);
}

TEST_CASE("Few gestures are learnt with a warning", "[train]") {
  const auto few = train_gesture({performed({.gestures = 12})}, {});
  REQUIRE(few.has_value());
  CHECK(warned(*few, "only 12 gestures"));
  const auto one = train_gesture({performed({.script = {"g"}})}, {});
  REQUIRE(one.has_value());
  CHECK(valid(*one));
  CHECK(warned(*one, "'g' was recorded once only"));
}

TEST_CASE("Leaves of the hold that mix classes are reported", "[train]") {
  // Scissors (c) are recorded only once, which is too few frames for separate leaves.
  const auto model = train_gesture(
      {performed({.script = {"g", "p", "g", "p", "g", "c", "p", "g", "p", "g", "p", "g"}})}, {});
  REQUIRE(model.has_value());
  CHECK(warned(*model, "a label that was not recorded may go astray"));
}

TEST_CASE("A recording that nothing can be learnt from is refused", "[train]") {
  Recording recording = performed({.gestures = 30});
  const auto refusal = [&](const Recording& bad) {
    const auto model = train_gesture({bad}, {});
    return model ? std::string() : model.error().message;
  };
  Recording still = recording;
  for (Eigen::Index t = 1; t < still.angles_rad.rows(); ++t) {
    still.angles_rad.row(t) = still.angles_rad.row(0);
  }
  CHECK(refusal(still).find("no angle changes") != std::string::npos);
  Recording strange = recording;
  strange.segments[3].label = "wave";
  CHECK(refusal(strange).find("label 'wave' is in no class") != std::string::npos);
  Recording bare = recording;
  bare.segments.clear();
  CHECK(refusal(bare).find("no gesture is labelled") != std::string::npos);
}

TEST_CASE("Constant channels do no harm", "[train]") {
  Recording recording = performed({.gestures = 30});
  recording.angles_rad.middleCols(kFingerChannels, kFingerChannels).setConstant(0.3);  // the index
  const auto model = train_gesture({recording}, {});
  REQUIRE(model.has_value());
  CHECK(valid(*model));
  for (int state = 0; state < kStates; ++state) {
    CHECK(model->trees[state][1].leaves.size() == 1);
    CHECK(model->trees[state][1].leaves[0].mean[0][0] == Approx(0.3));
  }
}

TEST_CASE("Clips that cannot be a recording are refused", "[recording]") {
  const auto performance = make_performance({.gestures = 3});
  const auto refusal = [](const clip::HandClip& clip) {
    const auto recording = recording_of(clip, 30.0);
    return recording ? std::string() : recording.error().message;
  };
  clip::HandClip clip = performance->clip;
  clip.angles[7][9] = std::numeric_limits<double>::quiet_NaN();
  CHECK(refusal(clip) == "frame 8 lacks a value; fill gaps with `posed smooth` before training");
  clip = performance->clip;
  clip.time_s[20] = clip.time_s[19];
  CHECK(refusal(clip).find("not after the one before") != std::string::npos);
  clip = performance->clip;
  clip.angles[5][9] = 57.3;
  CHECK(refusal(clip).find("angles are in radians") != std::string::npos);
  clip.time_s.resize(4);
  clip.angles.resize(4);
  CHECK(refusal(clip).find("a gesture alone needs 5") != std::string::npos);
}

TEST_CASE("Labels that do not fit the recording are refused with their line", "[recording]") {
  const auto performance = make_performance({.gestures = 3});
  auto recording = recording_of(performance->clip, 30.0);
  const auto late = cut(*recording, {{0.0, 1000.0, "g", 4}}, "take.lab");
  REQUIRE_FALSE(late.has_value());
  CHECK(late.error().line == 4);
  CHECK(late.error().file == "take.lab");
  const auto brief = cut(*recording, {{0.0, 0.1, "g", 2}}, "take.lab");
  REQUIRE_FALSE(brief.has_value());
  CHECK(brief.error().message.find("has 3 frames") != std::string::npos);
}

TEST_CASE("A faster recording is brought to the model's rate", "[recording]") {
  const auto fast = make_performance({.gestures = 10, .rate_hz = 120.0});
  auto recording = recording_of(fast->clip, 30.0);
  REQUIRE(recording.has_value());
  CHECK(recording->angles_rad.rows() ==
        Approx(static_cast<double>(fast->clip.angles.size()) / 4).margin(1));
  CHECK(recording->angles_rad(50, 9) == Approx(fast->clip.angles[200][9]));
  CHECK(cut(*recording, fast->labels, "fast.lab").has_value());
}

TEST_CASE("The order of the tasks does not change a bit of a gesture model", "[train]") {
  const std::vector<Recording> recordings{performed({.gestures = 25}),
                                          performed({.person = 2, .gestures = 25})};
  TrainOptions options;
  options.embedded_rounds = 2;
  const std::string forward = serialize_model(train_gesture(recordings, options).value());
  test::BackwardTasks backward;
  options.tasks = &backward;
  CHECK(serialize_model(train_gesture(recordings, options).value()) == forward);
}

TEST_CASE("Training asks in every round of its tasks, and at every tree, whether to stop",
          "[train]") {
  const auto recording = performed({.gestures = 20});
  const TrainOptions defaults;
  const auto trained_by = [&](AskedTasks& tasks, int trees) {
    int grown = 0;
    TrainOptions options;
    options.tasks = &tasks;
    options.progress = [&](std::string_view step, double /*fraction*/) {
      return step != "growing trees" || ++grown <= trees;
    };
    return train_gesture({recording}, options);
  };
  AskedTasks patient(100'000);
  CHECK(trained_by(patient, 1000));
  CHECK(patient.asked() >= 3 * (defaults.segmental_rounds + defaults.rounds));  // three labels
  AskedTasks hasty(5);
  const auto stopped = trained_by(hasty, 1000);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().message.find("stopped") != std::string::npos);
  CHECK(hasty.asked() < 20);
  AskedTasks again(100'000);
  CHECK_FALSE(trained_by(again, 7));
}
