#include "models/generate/generate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::generate {

GenerateStage::GenerateStage(std::shared_ptr<const Skeleton> skeleton,
                             const smooth::LiveOptions& options, double rate_hz,
                             const BoundModel* model)
    : skeleton_(std::move(skeleton)),
      hand_(hand_side(*skeleton_).has_value()),
      smoother_(*skeleton_, options, model != nullptr ? model->live.get() : nullptr),
      player_(rate_hz),
      model_(model) {
  player_.set_model(model);
}

// RT-safe.
void GenerateStage::set_model(const BoundModel* model) noexcept {
  model_ = model;
  static_cast<void>(smoother_.set_model(model != nullptr ? model->live.get() : nullptr));
  player_.set_model(model);
}

// RT-safe.
void GenerateStage::step(const Frame* in, std::int64_t now_ns, Emit& emit) noexcept {
  emit_ = &emit;
  if (in != nullptr && in->skeleton != skeleton_->id) {
    smoother_.flush(*this);
    emit.frame(*in);  // a frame of another skeleton
  } else if (in != nullptr && in->source == Source::kLabels) {
    last_ = *in;
    has_last_ = true;
    show(last_, nullptr);
  } else if (in != nullptr) {
    ++entered_;
    smoother_.step(in, now_ns, *this);
  } else {
    smoother_.step(nullptr, now_ns, *this);
    if (!performs() || !has_last_) return;
    // The last frame with its header advanced in time.
    Header& header = last_.header;
    if (header.device_ns != kNoTime_ns) header.device_ns += now_ns - header.arrival_ns;
    header.arrival_ns = now_ns;
    const bool only_performs = last_.source == Source::kLabels && !live_seen_;
    show(last_, only_performs ? nullptr : &live_);
  }
}

// RT-safe.
void GenerateStage::flush(Emit& emit) noexcept {
  emit_ = &emit;
  smoother_.flush(*this);
}

// RT-safe.
void GenerateStage::frame(const Frame& frame) noexcept {
  entered_ = std::max(entered_ - 1, 0);
  const auto variance = smoother_.variance_rad2();
  channels_ = std::min(variance.size(), variance_rad2_.size());
  std::copy_n(variance.begin(), channels_, variance_rad2_.begin());
  if (!hand_) return emit_->frame(frame);
  const HandAngles angles = hand_angles(frame);
  for (std::size_t c = 0; c < live_.size(); ++c) {
    if (std::isfinite(angles[c])) live_[c] = angles[c];
  }
  live_seen_ = true;
  last_ = frame;
  has_last_ = true;
  show(last_, &live_);
}

// Emits the frame with the gesture player's pose. RT-safe.
void GenerateStage::show(Frame& frame, const HandAngles* live) noexcept {
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
  emit_->frame(frame);
}

}  // namespace posed::generate
