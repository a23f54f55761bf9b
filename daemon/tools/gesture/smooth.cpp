// `posed smooth`: runs a recorded hand through gate and live smoother, as a stream would have been.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "models/gate/gate_stage.hpp"
#include "models/gesture/model_file.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr std::size_t kProgressEvery = 1000;  // frames

struct SmoothOptions {
  std::string in, out, model, lag = "1", hand;
  double noise_deg = 0.0;
  bool overwrite = false, json = false;
};

// Writes the smoother's output to the clip's rows, and counts.
class Rows final : public StageOut {
 public:
  explicit Rows(clip::HandClip& clip) : clip_(clip) {}

  void frame(const StageFrame& made) noexcept override {
    const Frame& frame = made.frame;
    HandAngles& row = clip_.angles[next_++];
    const HandAngles angles = hand_angles(frame);
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (!std::isfinite(row[c]) && std::isfinite(angles[c])) ++bridged_values;
      row[c] = angles[c];
    }
    labels.emplace_back(frame.label.data());
    probability.push_back(static_cast<double>(frame.label_probability));
  }

  long bridged_values = 0;
  std::vector<std::string> labels;
  std::vector<double> probability;

 private:
  clip::HandClip& clip_;
  std::size_t next_ = 0;
};

// Passes what the gate lets through to the smoother, and counts what it drops.
class Gated final : public StageOut {
 public:
  Gated(const std::vector<HandAngles>& measured, smooth::LiveSmoother& smoother, StageOut& rows)
      : measured_(measured), smoother_(smoother), rows_(rows) {}

  void frame(const StageFrame& made) noexcept override {
    const HandAngles& before = measured_[next_++];
    const HandAngles after = hand_angles(made.frame);
    std::array<bool, kHandJoints> dropped{};
    for (std::size_t c = 0; c < after.size(); ++c) {
      if (std::isfinite(after[c]) || !std::isfinite(before[c])) continue;
      dropped[c / 3] = true;
      ++dropped_values;
    }
    for (std::size_t j = 0; j < dropped.size(); ++j) dropped_frames_[j] += dropped[j] ? 1 : 0;
    smoother_.process(made, rows_);
  }

  // The joints of which something was dropped, the worst first.
  [[nodiscard]] std::vector<Findings> joints(const Skeleton& skeleton) const {
    std::vector<std::size_t> order(dropped_frames_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::ranges::greater{},
                             [this](std::size_t j) { return dropped_frames_[j]; });
    std::vector<Findings> list;
    for (const std::size_t j : order) {
      if (dropped_frames_[j] == 0) break;
      const double share =
          static_cast<double>(dropped_frames_[j]) / static_cast<double>(measured_.size());
      const std::string name = clean(skeleton.joints[j + 1].name);
      list.push_back(Findings().add("joint", name).add("share", share));
      if (share >= kWorthSaying) {
        list.back().say(fmt::format("{}: {:.1f} % dropped as false", name, 100.0 * share));
      }
    }
    return list;
  }

  long dropped_values = 0;

 private:
  static constexpr double kWorthSaying = 0.001;

  const std::vector<HandAngles>& measured_;
  smooth::LiveSmoother& smoother_;
  StageOut& rows_;
  std::size_t next_ = 0;
  std::array<long, kHandJoints> dropped_frames_{};
};

Result<std::unique_ptr<Stage>> make_gate(const Skeleton& skeleton, double rate_hz) {
  const StageType& type = gate::gate_type();
  auto parameters = TRY(complete_parameters(type.parameters, {}));
  return type.make({.skeleton = std::make_shared<const Skeleton>(skeleton),
                    .rate_hz = rate_hz,
                    .parameters = std::move(parameters)},
                   nullptr);
}

// The recognised gestures, one entry for each run of frames.
std::vector<Findings> recognised(const Rows& rows, const clip::HandClip& clip) {
  std::vector<Findings> runs;
  for (std::size_t begin = 0, end = 0; begin < rows.labels.size(); begin = end) {
    double sum = 0.0;
    while (end < rows.labels.size() && rows.labels[end] == rows.labels[begin]) {
      sum += rows.probability[end++];
    }
    runs.push_back(Findings()
                       .add("label", rows.labels[begin])
                       .add("start_s", clip.time_s[begin])
                       .add("frames", end - begin)
                       .add("mean_probability", sum / static_cast<double>(end - begin)));
  }
  return runs;
}

Result<std::unique_ptr<const smooth::LiveModel>> load(const std::string& path,
                                                      const Skeleton& skeleton) {
  const auto model = TRY(gesture::load_model(path));
  return smooth::bind_live_model(model, skeleton, path);
}

Result<smooth::LiveOptions> live_options(const SmoothOptions& options, double rate_hz) {
  const auto lag = TRY(smooth::parse_lag(options.lag));
  const int frames = smooth::lag_frames(lag, 1.0 / rate_hz);
  if (lag.seconds == 0.0 && frames < lag.frames) {
    return misuse("a lag of " + options.lag + " frames is too long at " +
                  std::to_string(std::lround(rate_hz)) + " Hz; give at most " +
                  std::to_string(frames));
  }
  return smooth::LiveOptions{.lag = lag, .noise_rad = options.noise_deg / kDegrees};
}

Result<> smooth(const SmoothOptions& options) {
  TRY(OutputFiles(options.overwrite)
          .reads(options.in)
          .reads(options.model)
          .writes(options.out, {".csv"})
          .check());
  clip::ReadOptions read;
  if (!options.hand.empty()) read.hand = side_named(options.hand);
  auto clip = TRY(clip::read_hand_clip(options.in, read));
  for (const std::string& warning : clip.warnings) {
    std::fprintf(stderr, "posed: %s\n", clean(options.in + ": " + warning).c_str());
  }
  const auto live = TRY(live_options(options, clip.rate_hz));
  const Skeleton skeleton = hand_skeleton(clip.side);
  std::unique_ptr<const smooth::LiveModel> model;
  if (!options.model.empty()) {
    model = TRY(load(options.model, skeleton));
  }

  smooth::LiveSmoother smoother(skeleton, live, model.get());
  const auto gate = TRY(make_gate(skeleton, clip.rate_hz));
  const std::vector<HandAngles> measured = clip.angles;
  Rows rows(clip);
  Gated gated(measured, smoother, rows);
  ProgressBar bar(kQuietFor_s);
  for (std::size_t t = 0; t < measured.size(); ++t) {
    const bool shows = t % kProgressEvery == 0;
    if (shows &&
        !bar.show("smoothing", static_cast<double>(t) / static_cast<double>(measured.size()))) {
      return fail("stopped; nothing was written", options.in);
    }
    Frame frame;
    set_hand_angles(skeleton, measured[t], frame);
    frame.header.sequence = t + 1;
    frame.header.device_ns = nanoseconds(clip.time_s[t] - clip.time_s[0]);
    gate->process({.frame = frame}, gated);
  }
  smoother.flush(rows);
  TRY(clip::write_hand_csv(clip, options.out));
  bar.finish();

  const int lag_frames = smooth::lag_frames(live.lag, 1.0 / clip.rate_hz);
  const double lag_ms = 1e3 * lag_frames / clip.rate_hz;
  const double noise_deg = smoother.noise_rad() * kDegrees;
  Findings findings;
  findings.add("out", options.out)
      .add("frames", measured.size())
      .add("rate_hz", clip.rate_hz)
      .add("lag_frames", lag_frames)
      .add("lag_ms", lag_ms)
      .add("noise_deg", noise_deg)
      .add("noise_given", options.noise_deg > 0.0)
      .add("bridged_values", rows.bridged_values)
      .add("dropped_values", gated.dropped_values)
      .say(fmt::format(
          "{}: {} frames, {} behind ({:.0f} ms at {:g} Hz), sensor noise {:.2f} deg "
          "(standard deviation of an angle{}), {} missing values bridged, {} false ones "
          "dropped",
          options.out, measured.size(), lag_frames, lag_ms, clip.rate_hz, noise_deg,
          options.noise_deg > 0.0 ? "" : ", estimated", rows.bridged_values, gated.dropped_values));
  findings.add("dropped", gated.joints(skeleton));
  if (model) findings.add("labels", recognised(rows, clip));
  findings.show(options.json);
  return {};
}

}  // namespace

void add_smooth(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("smooth", "Smooth a recorded hand as the live stage would");
  auto options = std::make_shared<SmoothOptions>();
  command
      ->add_option("in", options->in,
                   "The hand, or a body with finger joints: " + clip::listed(clip::Use::kRead))
      ->required()
      ->type_name("IN");
  command->add_option("--out", options->out, "The hand CSV to write")
      ->required()
      ->type_name("OUT.csv");
  command->add_option("--lag", options->lag, "Delay of the output, in frames or time: 1 or 33ms")
      ->capture_default_str();
  command
      ->add_option("--noise-deg", options->noise_deg,
                   "Sensor noise, standard deviation (default: estimated from IN)")
      ->check(in_range(0.01, 30.0));
  command
      ->add_option("--model", options->model,
                   "Gesture model, to recognise gestures and bridge gaps")
      ->type_name("H.gesture");
  command->add_option("--hand", options->hand, "The hand of a hand CSV, or which hand to take")
      ->check(CLI::IsMember({"left", "right"}));
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--json", options->json, "Summary as one JSON object on stdout");
  command->footer(R"(Examples:
  posed smooth glove.csv --out smooth.csv                     # lag 1 frame, noise estimated
  posed smooth --lag 33ms --noise-deg 1 glove.csv --out smooth.csv
  posed smooth --model H.gesture glove.csv --out smooth.csv --json   # recognises gestures, too
The code is the live stream's: a row is estimated from what came up to the lag after it. An empty
field is a missing value and is bridged; rows keep their times, even or not.)");
  command->callback([options, &exit_code] { exit_code = report(smooth(*options)); });
}

}  // namespace posed::tools
