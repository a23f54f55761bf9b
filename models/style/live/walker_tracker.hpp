// WalkerTracker: what the style stage measures of its walker: whether the model knows the
// motion (gate), the walker's own neutral pose (warm-up), and how much of the style it shows
// already. README.md has a section on each. State of one stream. RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "models/stage.hpp"
#include "models/style/live/bound_model.hpp"
#include "models/style/live/gate.hpp"
#include "models/style/live/style_estimate.hpp"
#include "models/style/live/warm_up.hpp"

namespace posed::style {

class WalkerTracker {
 public:
  // The notices, in the order of style_type().
  enum Notice : std::size_t { kNoGateData, kWarmedUp, kStood, kInterrupted, kOtherJoints, kNoAxis };

  // Advances by a frame's q, `gap_s` after the last one, of which `dt_s` count, and writes what the
  // kernel shall see of it: q as if the walker's neutral walk were the training's, and where a part
  // of the body does something else, what it does in a walk at this instant. Returns whether that
  // has changed suddenly.
  bool see(const BoundModel& model, const Frame& frame, std::span<const float> q,
           std::span<const std::uint8_t> available, double gap_s, double dt_s,
           std::span<float> input) noexcept;

  void set_gate(bool on) noexcept { gate_on_ = on; }
  void set_auto_alpha(bool on) noexcept { auto_alpha_ = on; }
  [[nodiscard]] float open() const noexcept { return gate_.open(); }
  // How far each part of the body walks: 1 all, 0 it does something else.
  [[nodiscard]] float trust(BodyPart part) const noexcept {
    return trust_[static_cast<std::size_t>(part)];
  }
  // Whether `input` of see() is a pose of training that stands for the walker's.
  [[nodiscard]] bool shifts() const noexcept { return shifts_; }
  // Of the walker now; a usual one where that is not known.
  [[nodiscard]] double cadence_rad_s(const BoundModel& model) const noexcept;
  // See Gate::settle().
  void settle() noexcept { gate_.settle(); }

  // 0: none of it, 1: all of it; NaN: unknown.
  [[nodiscard]] double estimate() const noexcept { return estimate_.value(); }

  // Starts a warm-up of so many seconds, in the place of one that runs. False for a model that has
  // no data for it.
  [[nodiscard]] bool warm_up(const BoundModel* model, double seconds) noexcept;
  // The walker is known from elsewhere, in the model's pose space. False as above.
  [[nodiscard]] bool know(const BoundModel* model, const Walker& walker) noexcept;
  // Nothing more comes to measure on.
  void interrupt() noexcept;
  // In the place of a warm-up; empty: none.
  void set_walker(const std::optional<Walker>& walker) noexcept {
    walker_ = walker;
    adapted_ = false;
  }
  [[nodiscard]] const std::optional<Walker>& walker() const noexcept { return walker_; }

  // The model is exchanged. What is known of the walker is kept where both see the same joints.
  void exchange(const BoundModel* from, const BoundModel& to) noexcept;

  void report(Notice notice) noexcept { pending_ |= 1U << notice; }
  [[nodiscard]] std::optional<StageNotice> take_notice() noexcept;

 private:
  [[nodiscard]] bool serves(const BoundModel* model) noexcept;
  void report_missing_data(const BoundModel& model) noexcept;
  void adapt(const BoundModel& model) noexcept;
  void relate(const BoundModel& model, std::span<const float> q,
              std::span<const std::uint8_t> available, std::span<float> input) noexcept;
  void replace_untrusted(const BoundModel& model, std::span<const std::uint8_t> available,
                         std::span<float> input) noexcept;
  bool measure(const BoundModel& model, std::span<const float> q,
               std::span<const std::uint8_t> available, double gap_s, double dt_s) noexcept;

  bool gate_on_ = true, auto_alpha_ = false;
  Gate gate_;
  WarmUp warm_up_;
  std::optional<Walker> walker_;
  // Of the walker and the model, once they are adapted to each other.
  bool adapted_ = false;
  bool shifts_ = false;                       // by the walker's cycle; else by its mean
  LegMap shift_;                              // from the walker's neutral walk to the model's
  const BoundModel::Usual* usual_ = nullptr;  // the neutral walk that is nearest to the walker's
  bool replaced_ = false;                     // something of the last frame
  std::array<float, motion::kMaxPoseDims> whole_{};  // its input before
  std::array<float, kBodyParts> trust_ = {1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F};
  StyleEstimate estimate_;
  std::uint32_t pending_ = 0;
  bool reported_no_gate_ = false, reported_no_axis_ = false;
};

}  // namespace posed::style
