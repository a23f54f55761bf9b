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
  // kernel shall see of it: q as if the walker's neutral pose were the training's. Returns whether
  // that has changed suddenly.
  bool see(const BoundModel& model, const Frame& frame, std::span<const float> q,
           std::span<const std::uint8_t> available, double gap_s, double dt_s,
           std::span<float> input) noexcept;

  void set_gate(bool on) noexcept { gate_on_ = on; }
  void set_auto_alpha(bool on) noexcept { auto_alpha_ = on; }
  [[nodiscard]] float open() const noexcept { return gate_.open(); }
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
  void set_walker(const std::optional<Walker>& walker) noexcept { walker_ = walker; }
  [[nodiscard]] const std::optional<Walker>& walker() const noexcept { return walker_; }

  // The model is exchanged. What is known of the walker is kept where both see the same joints.
  void exchange(const BoundModel* from, const BoundModel& to) noexcept;

  void report(Notice notice) noexcept { pending_ |= 1U << notice; }
  [[nodiscard]] std::optional<StageNotice> take_notice() noexcept;

 private:
  [[nodiscard]] bool serves(const BoundModel* model) noexcept;
  void report_missing_data(const BoundModel& model) noexcept;
  void relate(const BoundModel& model, std::span<const float> q,
              std::span<float> input) const noexcept;
  bool measure(const BoundModel& model, std::span<const float> q,
               std::span<const std::uint8_t> available, double gap_s, double dt_s) noexcept;

  bool gate_on_ = true, auto_alpha_ = false;
  Gate gate_;
  WarmUp warm_up_;
  std::optional<Walker> walker_;
  StyleEstimate estimate_;
  std::uint32_t pending_ = 0;
  bool reported_no_gate_ = false, reported_no_axis_ = false;
};

}  // namespace posed::style
