// Training as in Sato et al. (--mode paper) on synthetic walkers: its cycles, its kernel and its
// effect on a walk.
#include <catch2/catch.hpp>

#include <optional>
#include <string_view>
#include <vector>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/judge/evaluate.hpp"
#include "models/style/live/apply.hpp"
#include "models/style/train/train.hpp"
#include "models/tasks.hpp"

using namespace posed;
using motion::WalkerFamily;

namespace {

clip::Clip noisy_walker(WalkerFamily family, double noise_deg) {
  return motion::make_walker({.family = family, .person = 1, .noise_deg = noise_deg}).value();
}

std::vector<style::TrainingClip> march_and_sway(double noise_deg) {
  return {{noisy_walker(WalkerFamily::kMarch, noise_deg), "march", "march", "walk"},
          {noisy_walker(WalkerFamily::kSway, noise_deg), "sway", "sway", "walk"}};
}

// Somebody asks to stop while the evidence search runs, which is told when it looks.
class StopInSearch final : public TaskRunner {
 public:
  std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                             const TaskProgress& progress) override {
    return serial_.run(count, task, progress);
  }
  [[nodiscard]] bool stopping() const override {
    if (searching) ++looks;
    return searching;
  }
  bool searching = false;
  mutable int looks = 0;

 private:
  SerialTasks serial_;
};

style::StyleModel trained(style::TrainMode mode, double noise_deg) {
  const auto clips = march_and_sway(noise_deg);
  style::TrainOptions options;
  options.target = "sway";
  options.mode = mode;
  return style::train_style(clips, options).value();
}

}  // namespace

TEST_CASE("paper mode's mean cycle is the walker's, joints that never move included",
          "[style][train]") {
  const Eigen::MatrixXd paper = trained(style::TrainMode::kPaper, 0.0).process.inputs;
  const Eigen::MatrixXd harmonic = trained(style::TrainMode::kDefault, 0.0).process.inputs;
  // The mean over a cycle does not depend on where its phases begin.
  const Eigen::RowVectorXd paper_mean = paper.colwise().mean();
  const Eigen::RowVectorXd mean = harmonic.topRows(style::kGridFrames).colwise().mean();
  CHECK((paper_mean - mean).cwiseAbs().maxCoeff() < 0.03);
}

TEST_CASE("paper mode keeps a noise that floats can hold and brings a walk near the target",
          "[style][train]") {
  const style::StyleModel model = trained(style::TrainMode::kPaper, 0.3);
  CHECK(model.process.noise >= 3e-7);
  const clip::Clip march = noisy_walker(WalkerFamily::kMarch, 0.2);
  const auto styled = style::apply_to_clip(model, "paper.style", march, {}).value();
  const auto score =
      style::evaluate_style(march, styled.clip, noisy_walker(WalkerFamily::kSway, 0.2)).value();
  CHECK(score.cycle_ratio < 0.4);
  CHECK(score.jerk_ratio < 2.0);
}

TEST_CASE("paper mode's evidence search ends when it is asked to stop", "[style][train]") {
  StopInSearch tasks;
  style::TrainOptions options;
  options.target = "sway";
  options.mode = style::TrainMode::kPaper;
  options.dataset.tasks = &tasks;
  options.dataset.progress = [&](std::string_view step, double /*fraction*/) {
    tasks.searching = step == "learning the difference";
    return tasks.looks == 0;
  };
  const auto stopped = style::train_style(march_and_sway(0.3), options);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().message == "the training was stopped; nothing was written");
  CHECK(tasks.looks == 1);  // it does not go on after that
}
