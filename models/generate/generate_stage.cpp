#include "models/generate/generate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::generate {
namespace {

// Silence after which frames that wait go out: longer than a frame that is only late.
constexpr std::int64_t kSilence_ns = 100'000'000;
constexpr std::int64_t kSilentFrames = 4;
constexpr double kMaxStep_s = 0.1;  // of the heading: a frame of the slowest stream

}  // namespace

GenerateStage::GenerateStage(std::shared_ptr<const Skeleton> skeleton,
                             const smooth::LiveOptions& options, double rate_hz,
                             const BoundModel* model)
    : skeleton_(std::move(skeleton)),
      smoother_(*skeleton_, options, model != nullptr ? model->live.get() : nullptr),
      player_(rate_hz, gesture::most_channels(*skeleton_)),
      model_(model),
      period_ns_(nanoseconds(1.0 / rate_hz)),
      live_(static_cast<std::size_t>(gesture::most_channels(*skeleton_))),
      read_(live_.size()) {
  if (hand_side(*skeleton_)) {
    hand_ = gesture::PoseChannels::of_hand(*skeleton_);
  } else {
    standing_.emplace(*skeleton_);
  }
  player_.set_model(model);
  take_channels();
}

// RT-safe.
void GenerateStage::take_channels() noexcept {
  if (hand_) {
    pose_channels_ = &*hand_;
  } else {
    pose_channels_ = model_ != nullptr ? &*model_->live->body : nullptr;
  }
}

// RT-safe.
void GenerateStage::use(const StageModel& model) noexcept {
  model_ = static_cast<const BoundModel*>(&model);
  static_cast<void>(smoother_.set_model(model_->live.get()));
  player_.set_model(model_);
  take_channels();
  if (hand_ || !has_last_) return;
  // The channels of a body are those of its model.
  std::ranges::fill(live_, 0.0);
  follow(last_);
  player_.go_on_from(used(live_));
}

// RT-safe.
bool GenerateStage::command(std::size_t index, const StageCommand& command) noexcept {
  if (index == kPlay) return player_.play(command.as<gesture::PlayOrder>());
  player_.stop();
  return true;
}

// RT-safe.
void GenerateStage::describe(std::size_t index, const StageCommand& command,
                             ShortText& text) const noexcept {
  if (index != kPlay || model_ == nullptr) return;
  const auto& labels = model_->gesture().labels;
  const auto order = command.as<gesture::PlayOrder>();
  for (const std::uint16_t label : order.labels()) {
    if (label >= labels.size() || text.cut()) return;
    if (!text.text().empty()) text.add(" ");
    text.add(labels[label].name);
  }
}

class GenerateStage::Smoothed final : public StageOut {
 public:
  Smoothed(GenerateStage& stage, StageOut& out) noexcept : stage_(stage), out_(out) {}
  void frame(const StageFrame& frame) noexcept override { stage_.smoothed(frame, out_); }

 private:
  GenerateStage& stage_;
  StageOut& out_;
};

// RT-safe.
void GenerateStage::process(const StageFrame& in, StageOut& out) noexcept {
  Smoothed smoothed(*this, out);
  if (in.frame.skeleton != skeleton_->id) {
    smoother_.flush(smoothed);
    out.frame({.frame = in.frame});  // not this stage's body
  } else if (in.frame.source == Source::kLabels) {
    rest(in, out);
  } else {
    ++entered_;
    smoother_.process(in, smoothed);
  }
}

// RT-safe.
void GenerateStage::heard(std::int64_t arrival_ns) noexcept {
  last_heard_ns_ = arrival_ns;
  last_tick_ns_ = kNoTime_ns;
}

// RT-safe.
std::int64_t GenerateStage::next_due_ns() const noexcept {
  const bool waiting = entered_ != 0 || performs();
  if (!waiting || last_heard_ns_ == kNoTime_ns) return kNoTime_ns;
  if (last_tick_ns_ != kNoTime_ns) return last_tick_ns_ + period_ns_;
  return last_heard_ns_ + std::max(kSilence_ns, kSilentFrames * period_ns_);
}

// RT-safe.
void GenerateStage::tick(std::int64_t now_ns, StageOut& out) noexcept {
  last_tick_ns_ = now_ns;
  flush(out);
  if (!performs() || !has_last_) return;
  // The last frame again, as it would have come by now.
  Header& header = last_.header;
  if (header.device_ns != kNoTime_ns) header.device_ns += now_ns - header.arrival_ns;
  header.arrival_ns = now_ns;
  const bool only_performs = last_.source == Source::kLabels && !live_seen_;
  show(last_, only_performs ? std::span<const double>() : used(live_), out);
}

// RT-safe.
void GenerateStage::flush(StageOut& out) noexcept {
  Smoothed smoothed(*this, out);
  smoother_.flush(smoothed);
}

// A frame comes out of the smoother. RT-safe.
void GenerateStage::smoothed(const StageFrame& in, StageOut& out) noexcept {
  entered_ = std::max(entered_ - 1, 0);
  channels_ = std::min(in.variance_rad2.size(), variance_rad2_.size());
  std::copy_n(in.variance_rad2.begin(), channels_, variance_rad2_.begin());
  if (pose_channels_ == nullptr) {
    return out.frame({.frame = in.frame, .variance_rad2 = variance_rad2()});
  }
  live_seen_ = true;
  last_ = in.frame;
  has_last_ = true;
  follow(last_);
  show(last_, used(live_), out);
}

// A frame of a stream that only performs: a hand at rest, or a body as it stands. RT-safe.
void GenerateStage::rest(const StageFrame& in, StageOut& out) noexcept {
  if (pose_channels_ == nullptr) return out.frame(in);
  const bool first = !std::exchange(has_last_, true);
  last_ = in.frame;
  if (!hand_ && first) {
    follow(last_);
    player_.go_on_from(used(live_));
  }
  show(last_, {}, out);
}

// Takes the live pose from a frame; what it did not measure stays. RT-safe.
void GenerateStage::follow(const Frame& frame) noexcept {
  const double dt_s = std::min(elapsed_.next_s(frame.header), kMaxStep_s);
  if (pose_channels_->has_heading(frame)) {
    static_cast<void>(heading_.update(pose_channels_->heading_rad(frame), dt_s));
  }
  const std::span<double> read = used(read_);
  pose_channels_->read(frame, heading_.value_rad(), read);
  pose_channels_->unwrap(used(live_), read);
  for (std::size_t c = 0; c < read.size(); ++c) {
    if (std::isfinite(read[c])) live_[c] = read[c];
  }
}

// What the player makes of the frame goes out. RT-safe.
void GenerateStage::show(Frame& frame, std::span<const double> live, StageOut& out) noexcept {
  const GesturePlayer::Pose shown = player_.step(live);
  if (shown.what != GesturePlayer::What::kLive) pose(shown, frame);
  if (shown.what == GesturePlayer::What::kPerformed) {
    const std::string& name = model_->gesture().labels[static_cast<std::size_t>(shown.label)].name;
    std::copy_n(name.begin(), std::min(name.size(), frame.label.size() - 1), frame.label.begin());
    frame.label_probability = 1.0F;
    const auto all = static_cast<std::size_t>(frame.angle_count);
    if (channels_ < all) {  // the smoother did not see this frame: it is exact but for these
      std::fill(variance_rad2_.begin(), variance_rad2_.begin() + frame.angle_count, 0.0);
      channels_ = all;
    }
    pose_channels_->spread(shown.variance_rad2, std::span(variance_rad2_).first(channels_));
  }
  out.frame({.frame = frame, .variance_rad2 = variance_rad2()});
}

// A body stays where its feet are: the model knows no place of the root. RT-safe.
void GenerateStage::pose(const GesturePlayer::Pose& shown, Frame& frame) noexcept {
  if (standing_) {
    const perform::Standing::Feet places_m = standing_->feet_m(frame);
    pose_channels_->write(shown.angles, heading_.value_rad(), frame);
    static_cast<void>(standing_->stand(places_m, frame));
  } else {
    pose_channels_->write(shown.angles, 0.0, frame);
  }
  frame.source = Source::kLabels;
  frame.quality = shown.what == GesturePlayer::What::kHeld ? Quality::kHeld : Quality::kMeasured;
  frame.label.fill('\0');
  frame.label_probability = 0.0F;
}

}  // namespace posed::generate
