#include "daemon/tools/gesture/gesture_report.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/command/options.hpp"
#include "daemon/tools/picture/figure.hpp"
#include "models/gesture/pose_channels.hpp"
#include "models/gesture/pose_distance.hpp"
#include "models/motion/naturalness.hpp"
#include "models/perform/body_performance.hpp"
#include "models/perform/constrain.hpp"
#include "models/perform/perform.hpp"
#include "models/smooth/live_smoother.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

constexpr std::size_t kMaxSegments = 8;  // of a recording that are drawn
constexpr double kBandDeviations = 2.0;
constexpr std::size_t kHoldStart = 2, kHoldEnd = 4;  // states, from 0

// Of the gesture's `index`-th label: frames [from, to) of these states.
struct FrameRange {
  int from = 0, to = 0;
  [[nodiscard]] int middle() const { return (from + to) / 2; }
};
FrameRange range_of(const perform::Performance& performance, std::size_t index,
                    std::size_t first_state, std::size_t end_state) {
  const perform::PerformedState* const states = &performance.states[index * gesture::kStates];
  const perform::PerformedState& first = states[first_state];
  const perform::PerformedState& last = states[end_state - 1];
  return {first.start, last.start + last.frames};
}

// One angle of each group: of a finger its middle joint's flexion, of a group of joints the one
// that moves most in the training recordings.
std::vector<std::size_t> shown_channels(const gesture::GestureModel& model) {
  std::vector<std::size_t> channels;
  for (const gesture::ChannelGroup& group : model.groups) {
    const auto first = static_cast<std::size_t>(group.first);
    std::size_t shown = first + (model.is_hand() ? 3 : 0);
    const auto range_rad = [&](std::size_t c) { return model.high[c] - model.low[c]; };
    const std::size_t end = model.is_hand() ? 0 : first + static_cast<std::size_t>(group.channels);
    for (std::size_t c = first; c < end; ++c) {
      if (range_rad(c) > range_rad(shown)) shown = c;
    }
    channels.push_back(shown);
  }
  return channels;
}

std::vector<report::AngleTrajectory> no_angles(const gesture::GestureModel& model,
                                               const std::vector<std::size_t>& channels) {
  std::vector<report::AngleTrajectory> angles;
  for (std::size_t g = 0; g < channels.size(); ++g) {
    const std::size_t c = channels[g];
    std::string name = model.groups[g].name + ", middle joint";
    if (!model.is_hand()) {
      name = fmt::format("{}: {} about {}", model.groups[g].name, model.body->joints[c / 3],
                         "xyz"[c % 3]);
    }
    angles.push_back({.name = std::move(name), .recorded = {}, .mean = {}, .low = {}, .high = {}});
  }
  return angles;
}

// Adds one frame of the performance at a time of the figure.
void add_frame(const perform::Performance& performance, int frame, double time_s,
               const std::vector<std::size_t>& channels,
               std::vector<report::AngleTrajectory>& angles) {
  const auto t = static_cast<std::size_t>(frame);
  for (std::size_t g = 0; g < angles.size(); ++g) {
    const std::size_t channel = channels[g];
    const double mean_deg = kDegrees * performance.angles[t][channel];
    const double band_deg =
        kDegrees * kBandDeviations * std::sqrt(performance.variances[t][channel]);
    angles[g].mean.push_back({time_s, mean_deg});
    angles[g].low.push_back({time_s, mean_deg - band_deg});
    angles[g].high.push_back({time_s, mean_deg + band_deg});
  }
}

// The figures of a gesture model in a report: what it performs, how it got there, and how it
// compares with recordings.
class GestureFigures {
 public:
  // `labels`: what is performed, indices into the model's; at least one. `body`: who performs a
  // model of bodies; empty for one of hands.
  static Result<GestureFigures> make(const std::shared_ptr<const gesture::GestureModel>& model,
                                     std::vector<int> labels,
                                     std::optional<perform::BodyFigure> body);

  // The performance as a strip, two poses a label.
  [[nodiscard]] report::Figure strip() const;
  // The performance's angles with their band.
  [[nodiscard]] report::Figure trajectories() const;
  // The same labels as the beginning of a recording, over what was recorded; empty for a recording
  // without labels of the model.
  [[nodiscard]] Result<std::optional<report::Figure>> over(
      const gesture::Recording& recording) const;
  // Each label of the model that was not recorded, in its hold, beside the nearest of these poses
  // [frame][channel], rad; empty where all were recorded.
  [[nodiscard]] std::optional<report::Figure> unseen(const gesture::FeatureMatrix& poses,
                                                     const std::string& from) const;
  [[nodiscard]] report::Figure durations() const;
  // One tree to begin with, then all of them, folded away.
  [[nodiscard]] std::vector<report::Figure> trees() const;
  // What it costs to know the labels late; computes the curve if it is empty.
  [[nodiscard]] Result<report::Figure> lag(std::vector<report::LagError> curve) const {
    if (curve.empty()) curve = TRY(lag_curve(information_, labels_));
    return report::lag_error(curve, model_->rate_hz);
  }

  [[nodiscard]] std::string label_text() const;  // "g 1 c"

 private:
  GestureFigures(std::shared_ptr<const gesture::GestureModel> model, std::vector<int> labels,
                 trajectory::StateInformation information, perform::Performance performance,
                 std::optional<perform::BodyFigure> body);
  [[nodiscard]] picture::Figure pose(const perform::Pose& angles_rad) const;
  [[nodiscard]] report::Figure strip_of(const std::string& title, const std::string& sentence,
                                        const std::vector<picture::StripRow>& rows) const;
  [[nodiscard]] report::Figure trajectories_of(const std::string& title,
                                               const std::string& sentence,
                                               const std::vector<report::AngleTrajectory>& angles,
                                               const std::vector<report::LabelSpan>& spans) const;
  [[nodiscard]] const std::string& name(int label) const;

  std::shared_ptr<const gesture::GestureModel> model_;
  std::vector<int> labels_;
  trajectory::StateInformation information_;
  perform::Performance performance_;  // of labels_
  std::optional<perform::BodyFigure> body_;
  std::shared_ptr<const Skeleton> skeleton_;
  picture::FigureShape shape_;
};

// As `posed synth` performs it.
Result<perform::Performance> performance_of(const trajectory::StateInformation& information,
                                            std::span<const int> labels) {
  auto performance = TRY(perform::perform(information, labels, {}));
  if (information.model().is_hand()) perform::constrain(performance, default_hand_shape());
  return performance;
}

Result<GestureFigures> GestureFigures::make(
    const std::shared_ptr<const gesture::GestureModel>& model, std::vector<int> labels,
    std::optional<perform::BodyFigure> body) {
  trajectory::StateInformation information(model, model->rate_hz);
  auto performance = TRY(performance_of(information, labels));
  return GestureFigures(model, std::move(labels), std::move(information), std::move(performance),
                        std::move(body));
}

GestureFigures::GestureFigures(std::shared_ptr<const gesture::GestureModel> model,
                               std::vector<int> labels, trajectory::StateInformation information,
                               perform::Performance performance,
                               std::optional<perform::BodyFigure> body)
    : model_(std::move(model)),
      labels_(std::move(labels)),
      information_(std::move(information)),
      performance_(std::move(performance)),
      body_(std::move(body)),
      skeleton_(body_ ? body_->skeleton()
                      : std::make_shared<const Skeleton>(hand_skeleton(Side::kRight))),
      shape_(skeleton_) {}

const std::string& GestureFigures::name(int label) const { return model_->labels[label].name; }

std::string GestureFigures::label_text() const {
  return joined(labels_, " ", [this](int label) { return name(label); });
}

picture::Figure GestureFigures::pose(const perform::Pose& angles_rad) const {
  if (body_) return shape_.pose(body_->pose(angles_rad).frame);
  Frame frame;
  frame.skeleton = skeleton_->id;
  frame.joint_count = static_cast<std::uint16_t>(skeleton_->joints.size());
  set_hand_angles(*skeleton_, perform::hand_of(angles_rad), frame);
  return shape_.pose(frame);
}

report::Figure GestureFigures::strip_of(const std::string& title, const std::string& sentence,
                                        const std::vector<picture::StripRow>& rows) const {
  const double heading_rad = body_ ? body_->heading_rad() : 0.0;
  return report::gesture_strip(title, sentence, rows,
                               picture::Camera(picture::View::kFront, shape_.facing(heading_rad)),
                               body_.has_value());
}

report::Figure GestureFigures::trajectories_of(const std::string& title,
                                               const std::string& sentence,
                                               const std::vector<report::AngleTrajectory>& angles,
                                               const std::vector<report::LabelSpan>& spans) const {
  return report::angle_trajectories(
      title,
      sentence + (model_->is_hand() ? ""
                                    : " Of each group the angle is shown that moves most in the "
                                      "training recordings, about its mean over them."),
      model_->is_hand() ? "flexion" : "angle", angles, spans);
}

report::Figure GestureFigures::strip() const {
  picture::StripRow row;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const std::string& label = name(labels_[k]);
    const int moving = range_of(performance_, k, 0, kHoldStart).middle();
    const int held = range_of(performance_, k, kHoldStart, kHoldEnd).middle();
    for (const auto& [frame, words] : {std::pair(moving, "to " + label), std::pair(held, label)}) {
      row.poses.push_back(
          {.figure = pose(performance_.angles[static_cast<std::size_t>(frame)]), .caption = words});
    }
  }
  const char* const part = model_->is_hand() ? "finger" : "group";
  std::string never;
  for (const gesture::Label& label : model_->labels) {
    if (!label.trained) add_word(never, label.name);
  }
  return strip_of(
      "\"" + label_text() + "\" as the model performs it",
      fmt::format("From left to right, two poses a gesture, on the way to it and held, {:.1f} s in "
                  "all; {}.{}",
                  static_cast<double>(performance_.angles.size()) / performance_.rate_hz,
                  shape_.legend(),
                  never.empty()
                      ? ""
                      : fmt::format(" Never recorded, composed {} by {}: {}.", part, part, never)),
      {row});
}

report::Figure GestureFigures::trajectories() const {
  const auto channels = shown_channels(*model_);
  auto angles = no_angles(*model_, channels);
  for (int t = 0; t < std::ssize(performance_.angles); ++t) {
    add_frame(performance_, t, t / performance_.rate_hz, channels, angles);
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    const FrameRange all = range_of(performance_, k, 0, gesture::kStates);
    spans.push_back(
        {name(labels_[k]), all.from / performance_.rate_hz, all.to / performance_.rate_hz});
  }
  return trajectories_of(
      "The performed angles, with what the model leaves open",
      "Lines are what is performed; where the band is wide, recordings differed and the model "
      "leaves room, where it is narrow, the pose is certain. Dashed lines begin a gesture.",
      angles, spans);
}

Result<std::optional<report::Figure>> GestureFigures::over(
    const gesture::Recording& recording) const {
  std::vector<gesture::Segment> segments;
  std::vector<int> labels;
  for (const gesture::Segment& segment : recording.segments) {
    const int label = model_->label_index(segment.label);
    if (label < 0 || segments.size() == kMaxSegments) break;
    segments.push_back(segment);
    labels.push_back(label);
  }
  if (labels.empty()) return std::nullopt;
  const auto performance = TRY(performance_of(information_, labels));
  const auto channels = shown_channels(*model_);
  auto angles = no_angles(*model_, channels);
  const double period_s = 1.0 / recording.rate_hz;
  for (int t = segments.front().begin; t < segments.back().end; ++t) {
    for (std::size_t g = 0; g < angles.size(); ++g) {
      const auto channel = static_cast<Eigen::Index>(channels[g]);
      angles[g].recorded.push_back({t * period_s, kDegrees * recording.angles_rad(t, channel)});
    }
  }
  std::vector<report::LabelSpan> spans;
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const gesture::Segment& segment = segments[k];
    const FrameRange performed = range_of(performance, k, 0, gesture::kStates);
    const double stretch = static_cast<double>(segment.frames()) / (performed.to - performed.from);
    for (int t = performed.from; t < performed.to; ++t) {
      const double frame = segment.begin + (t + 0.5 - performed.from) * stretch;
      add_frame(performance, t, frame * period_s, channels, angles);
    }
    spans.push_back({segment.label, segment.begin * period_s, segment.end * period_s});
  }
  return trajectories_of(
      "A recording and the model's motion for the same labels",
      "The model knows the labels alone; each gesture is stretched to the recorded one's length. "
      "Where the recorded line stays within the band, the model describes this movement.",
      angles, spans);
}

std::optional<report::Figure> GestureFigures::unseen(const gesture::FeatureMatrix& poses,
                                                     const std::string& from) const {
  picture::StripRow performed{.title = "performed", .poses = {}};
  picture::StripRow nearest{.title = "nearest pose of " + from, .poses = {}};
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    if (model_->labels[labels_[k]].trained) continue;
    const int held = range_of(performance_, k, kHoldStart, kHoldEnd).middle();
    const perform::Pose& wanted = performance_.angles[held];
    const Eigen::Map<const Eigen::RowVectorXd> row(wanted.data(), poses.cols());
    Eigen::Index at = 0;
    (poses.rowwise() - row).rowwise().squaredNorm().minCoeff(&at);
    const perform::Pose real(poses.row(at).begin(), poses.row(at).end());
    const double off_deg = kDegrees * gesture::apart(*model_, wanted, real).rms_rad();
    performed.poses.push_back({.figure = pose(wanted), .caption = name(labels_[k])});
    const std::string words = fmt::format("{:.1f}° off", off_deg);
    nearest.poses.push_back({.figure = pose(real), .caption = words});
  }
  if (performed.poses.empty()) return std::nullopt;
  return strip_of(
      "Gestures that were never recorded, beside real poses",
      fmt::format(
          "Above what the model composes, below the recorded pose nearest to it (rms over all {}): "
          "a reference that shows these gestures says how right they are; one that does not, how "
          "new.",
          model_->is_hand() ? "angles" : "joints"),
      {performed, nearest});
}

report::Figure GestureFigures::durations() const {
  std::vector<report::LabelDurations> all;
  for (int label = 0; label < std::ssize(model_->labels); ++label) {
    const gesture::DurationGaussian& frames = gesture::duration(*model_, {label, label, label});
    report::LabelDurations durations{.label = name(label),
                                     .recorded = model_->labels[label].trained,
                                     .mean_s = {},
                                     .deviation_s = {}};
    for (std::size_t s = 0; s < gesture::kStates; ++s) {
      durations.mean_s.push_back(frames.mean[s] / model_->rate_hz);
      durations.deviation_s.push_back(std::sqrt(frames.variance[s]) / model_->rate_hz);
    }
    all.push_back(std::move(durations));
  }
  return report::state_durations(all);
}

std::vector<report::Figure> GestureFigures::trees() const {
  constexpr int kMiddle = 2, kFourth = 3;  // the tree that the paper shows
  const bool hand = model_->is_hand();
  const auto& of_state = model_->trees[kFourth];
  const auto leaves = [](const auto& tree) { return tree.leaves.size(); };
  const auto largest = std::ranges::max_element(of_state, {}, leaves) - of_state.begin();
  const int first = hand ? kMiddle : static_cast<int>(largest);
  const auto words = [&](int group) {
    const std::string& of_group = model_->groups[group].name;
    return hand ? "the " + of_group + " finger" : of_group;
  };
  std::vector<report::Figure> figures{report::decision_trees(
      "The decision tree of " + words(first) + " in state 4",
      gesture::draw_trees(*model_, {.state = kFourth, .group = first}), false)};
  for (int g = 0; g < std::ssize(model_->groups); ++g) {
    figures.push_back(report::decision_trees(
        "All trees of " + words(g), gesture::draw_trees(*model_, {.state = -1, .group = g}), true));
  }
  return figures;
}

constexpr const char* kNoGesture = "none";

// Notes the label of each frame that the smoother emits.
class RecognisedLabels final : public StageOut {
 public:
  explicit RecognisedLabels(Eigen::Index frames) : labels(static_cast<std::size_t>(frames)) {}
  void frame(const StageFrame& made) noexcept override {
    const std::uint64_t sequence = made.frame.header.sequence;
    if (sequence >= 1 && sequence <= labels.size()) labels[sequence - 1] = made.frame.label;
  }
  std::vector<std::array<char, kMaxLabel>> labels;  // [frame]
};

// `first`: a frame of the figure, whose channels the recording's poses replace.
std::vector<std::array<char, kMaxLabel>> recognised_in(const gesture::Recording& recording,
                                                       const Skeleton& skeleton, const Frame& first,
                                                       const gesture::PoseChannels& channels,
                                                       const smooth::LiveModel& model) {
  smooth::LiveSmoother smoother(skeleton, {}, &model);
  RecognisedLabels out(recording.angles_rad.rows());
  for (Eigen::Index t = 0; t < recording.angles_rad.rows(); ++t) {
    const auto row = recording.angles_rad.row(t);
    Frame frame = first;
    channels.write({row.data(), static_cast<std::size_t>(row.size())}, 0.0, frame);
    frame.header.sequence = static_cast<std::uint64_t>(t + 1);
    frame.header.device_ns = nanoseconds(static_cast<double>(t) / recording.rate_hz);
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  return std::move(out.labels);
}

using Counts = std::map<std::string, std::map<std::string, int>>;  // [given][recognised]

report::Confusion shares_of(const Counts& counts, const std::vector<std::string>& labels,
                            const std::string& measured_on) {
  report::Confusion confusion{
      .labels = labels, .given = {}, .share = {}, .frames = {}, .measured_on = measured_on};
  const bool some_none = std::ranges::any_of(
      counts, [](const auto& given) { return given.second.contains(kNoGesture); });
  if (some_none) confusion.labels.emplace_back(kNoGesture);
  for (const auto& [given, row] : counts) {
    int sum = 0;
    for (const auto& [label, count] : row) sum += count;
    std::vector<double> shares;
    for (const std::string& label : confusion.labels) {
      const auto found = row.find(label);
      shares.push_back(found == row.end() ? 0.0 : static_cast<double>(found->second) / sum);
    }
    confusion.given.push_back(given);
    confusion.share.push_back(std::move(shares));
    confusion.frames.push_back(sum);
  }
  return confusion;
}

// Which label the live stage recognises where another was given; empty for a model that it cannot
// use, with more labels than it follows.
std::optional<report::Figure> confusion_of(const gesture::GestureModel& model,
                                           const clip::Clip& body,
                                           const std::vector<gesture::Recording>& recordings,
                                           const std::string& measured_on) {
  const Skeleton skeleton = model.is_hand() ? hand_skeleton(Side::kRight) : *body.skeleton;
  const Frame first = model.is_hand() ? Frame{} : body.frame(0);
  const auto live = smooth::bind_live_model(model, skeleton, "the model");
  const auto channels = gesture::PoseChannels::bind(model, skeleton);
  if (!live || !channels) return std::nullopt;
  Counts counts;
  for (const gesture::Recording& recording : recordings) {
    const auto recognised = recognised_in(recording, skeleton, first, *channels, **live);
    for (const gesture::Segment& segment : recording.segments) {
      for (int t = segment.begin; t < segment.end; ++t) {
        const std::string label = recognised[t].data();
        ++counts[segment.label][label.empty() ? kNoGesture : label];
      }
    }
  }
  if (counts.empty()) return std::nullopt;
  std::vector<std::string> labels;
  for (const auto& [given, row] : counts) labels.push_back(given);
  for (const gesture::Label& label : model.labels) {
    const bool there = std::ranges::find(labels, label.name) != labels.end();
    if (label.trained && !there) labels.push_back(label.name);
  }
  return report::label_confusion(shares_of(counts, labels, measured_on));
}

Result<> add_comparison(const GestureReport& report, const GestureFigures& figures,
                        const gesture::GestureModel& model,
                        const std::vector<gesture::Recording>& recordings, report::Page& page) {
  if (recordings.empty()) return {};
  page.section("Beside " + report.recorded_by);
  const auto over = TRY(figures.over(recordings.front()));
  if (over) page.add(*over);
  if (const auto unseen = figures.unseen(all_poses(recordings), report.recorded_by)) {
    page.add(*unseen);
  }
  if (const auto confusion = confusion_of(model, report.body, recordings, report.recorded_by)) {
    page.add(*confusion);
  }
  return {};
}

}  // namespace

Result<std::vector<report::LagError>> lag_curve(const trajectory::StateInformation& information,
                                                std::span<const int> labels) {
  assert(!labels.empty());
  const auto rows_of = [&](const perform::PerformOptions& options) -> Result<motion::Rows> {
    const auto performance = TRY(perform::perform(information, labels, options));
    return perform::recording_of(information.model(), performance).angles_rad;
  };
  const auto full = TRY(rows_of({}));
  const double jerk = motion::jerk_rms(full);
  std::vector<report::LagError> curve;
  for (const int frames : {0, 1, 2, 3, 4, 6, 8, 10, 12, 15, 20, 25, 30, 40}) {
    perform::PerformOptions options;
    options.look_ahead = frames;
    const auto rows = TRY(rows_of(options));
    const motion::Rows off = rows - full;
    curve.push_back(
        {frames, kDegrees * std::sqrt(off.squaredNorm() / static_cast<double>(off.size())),
         kDegrees * off.cwiseAbs().maxCoeff(), jerk > 0.0 ? motion::jerk_rms(rows) / jerk : 1.0});
  }
  return curve;
}

std::vector<int> labels_to_show(const gesture::GestureModel& model) {
  if (auto paper = perform::labels_of(model, "g 1 c 3 4 p")) return std::move(*paper);
  std::vector<int> all(model.labels.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

gesture::FeatureMatrix all_poses(const std::vector<gesture::Recording>& recordings) {
  Eigen::Index frames = 0;
  for (const gesture::Recording& recording : recordings) frames += recording.angles_rad.rows();
  gesture::FeatureMatrix poses(frames, recordings.front().angles_rad.cols());
  frames = 0;
  for (const gesture::Recording& recording : recordings) {
    poses.middleRows(frames, recording.angles_rad.rows()) = recording.angles_rad;
    frames += recording.angles_rad.rows();
  }
  return poses;
}

Result<> write_gesture_report(const GestureReport& report,
                              const std::shared_ptr<const gesture::GestureModel>& model,
                              const std::vector<gesture::Recording>& recordings,
                              const Findings& findings, const std::filesystem::path& path) {
  std::optional<perform::BodyFigure> body;
  if (!model->is_hand()) {
    body = TRY(perform::BodyFigure::of(*model, report.body));
  }
  const auto drawn = TRY(GestureFigures::make(model, report.labels, std::move(body)));
  report::Page page(report.title, report.command);
  page.verdict(report.verdict, report.good);
  page.warnings(report.warnings);
  page.section("What it performs");
  page.add(drawn.strip());
  page.add(drawn.trajectories());
  TRY(add_comparison(report, drawn, *model, recordings, page));
  page.section("How it is made");
  const auto lag = TRY(drawn.lag(report.curve));
  page.add(lag);
  page.add(drawn.durations());
  for (const report::Figure& tree : drawn.trees()) page.add(tree);
  add_numbers(findings, "Counts and measures, by their names.", page);
  add_json(findings, page);
  return report::write_page(page, path);
}

}  // namespace posed::tools
