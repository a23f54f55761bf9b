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

}  // namespace

GenerateStage::GenerateStage(std::shared_ptr<const Skeleton> skeleton,
                             const smooth::LiveOptions& options, double rate_hz,
                             const BoundModel* model)
    : skeleton_(std::move(skeleton)),
      hand_(hand_side(*skeleton_).has_value()),
      smoother_(*skeleton_, options, model != nullptr ? model->live.get() : nullptr),
      player_(rate_hz),
      model_(model),
      period_ns_(nanoseconds(1.0 / rate_hz)) {
  player_.set_model(model);
}

// RT-safe.
void GenerateStage::use(const StageModel& model) noexcept {
  model_ = static_cast<const BoundModel*>(&model);
  static_cast<void>(smoother_.set_model(model_->live.get()));
  player_.set_model(model_);
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
    last_ = in.frame;
    has_last_ = true;
    show(last_, nullptr, out);
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
  show(last_, only_performs ? nullptr : &live_, out);
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
  if (!hand_) return out.frame({.frame = in.frame, .variance_rad2 = variance_rad2()});
  const HandAngles angles = hand_angles(in.frame);
  for (std::size_t c = 0; c < live_.size(); ++c) {
    if (std::isfinite(angles[c])) live_[c] = angles[c];
  }
  live_seen_ = true;
  last_ = in.frame;
  has_last_ = true;
  show(last_, &live_, out);
}

// What the player makes of the frame goes out. RT-safe.
void GenerateStage::show(Frame& frame, const HandAngles* live, StageOut& out) noexcept {
  const GesturePlayer::Pose& pose = player_.step(live);
  if (pose.what != GesturePlayer::What::kLive) {
    const Vec3f root_position_m = frame.root_position_m;
    set_hand_angles(*skeleton_, pose.angles, frame);
    frame.root_position_m = root_position_m;
    frame.source = Source::kLabels;
    frame.quality = pose.what == GesturePlayer::What::kHeld ? Quality::kHeld : Quality::kMeasured;
    frame.label.fill('\0');
    frame.label_probability = 0.0F;
  }
  if (pose.what == GesturePlayer::What::kPerformed) {
    const std::string& name = model_->gesture().labels[static_cast<std::size_t>(pose.label)].name;
    std::copy_n(name.begin(), std::min(name.size(), frame.label.size() - 1), frame.label.begin());
    frame.label_probability = 1.0F;
    channels_ = kHandChannels;
    for (std::size_t c = 0; c < channels_; ++c) {
      variance_rad2_[c] = pose.variance_rad2[kAngleOfChannel[c]];
    }
  }
  out.frame({.frame = frame, .variance_rad2 = variance_rad2()});
}

}  // namespace posed::generate
