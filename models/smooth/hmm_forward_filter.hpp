// HmmForwardFilter: estimates which gesture a live hand is in, and which state of it. It is the
// forward recursion of a hidden Markov model over the model's chains, left to right within a chain
// and then to any chain that may follow its label (models/smooth/README.md, "HMM forward filter").
// Likelihoods are tempered because a hand's features are far from independent; the recursion runs
// in the log domain. Backward sweeps over the window then give the state probabilities of each of
// its frames, given everything known by now.
//
// At another rate than the model's: models/trajectory/README.md, "State information and frame
// rate". Features are causal, so the features taken at a frame describe the frame before it.
// RT-safe except for construction; one thread.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "models/smooth/live_model.hpp"
#include "models/trajectory/information_form.hpp"

namespace posed::smooth {

class HmmForwardFilter {
 public:
  // For models of at most `max_channels` channels. `error_rad`: LiveOptions::error_rad.
  HmmForwardFilter(int max_window, int max_channels, double error_rad = 0.0);

  // Restarts with this model, which is not owned; with null, no gesture is recognised.
  RT_SAFE void set_model(const LiveModel* model) noexcept;
  [[nodiscard]] const LiveModel* model() const noexcept { return model_; }

  // The next frame: [channels of the model] rad, NaN where missing; `even`: it follows the previous
  // frame by one period.
  RT_SAFE void push(std::span<const double> measured_rad, bool even, double period_s,
                    double noise_rad) noexcept;

  // Sweeps back over the last `frames` pushed frames.
  RT_SAFE void sweep(int frames) noexcept;

  // Whether the last sweep covers the frame `back` before the newest; false for frames that came
  // before the model was set.
  RT_SAFE [[nodiscard]] bool knows(int back) const noexcept {
    return std::max(back - 1, 0) < swept_frames_;
  }

  // State probabilities of that frame from the last sweep; needs knows(back). [states], sums to 1.
  // The newest frame gets those of the frame before it.
  RT_SAFE [[nodiscard]] std::span<const double> states(int back) const noexcept;

  // The probability that the frame is none of the labels; 0 for models that do not know what is
  // none.
  RT_SAFE [[nodiscard]] double none(int back) const noexcept;

  // The most probable label of that frame, its index and probability. RT-safe.
  struct Answer {
    int label = -1;  // -1: the last sweep does not cover the frame; kNone: none of them
    double probability = 0.0;
  };
  static constexpr int kNone = -2;
  [[nodiscard]] Answer label(int back) const noexcept;

  // The stream's rate over the model's.
  RT_SAFE [[nodiscard]] double pace() const noexcept { return pace_; }

  RT_SAFE void reset() noexcept;

 private:
  // One state's Gaussian, three rows of features ([window][channel], padded) in rows_: mean, half
  // of the precision, half of the variance's logarithm; and its duration. All at the stream's rate
  // and noise.
  struct Table {
    double stay = 0.0, log_stay = 0.0, log_leave = 0.0;
  };
  enum TableRow : std::size_t { kMean, kHalfPrecision, kHalfLog, kTableRows };
  // [states], and what is none behind them
  using Row = std::array<double, kMaxLiveChains * gesture::kStates + 1>;
  using LabelRow = std::array<double, kMaxLiveChains>;  // [labels]

  [[nodiscard]] double* features_of(std::size_t state, TableRow row) noexcept {
    return rows_.data() + (state * kTableRows + row) * features_;
  }
  [[nodiscard]] const LiveState& state(std::size_t index) const noexcept {
    return index < static_cast<std::size_t>(states_) ? model_->states[index] : *model_->none;
  }
  // States and what is none.
  [[nodiscard]] std::size_t all() const noexcept {
    return static_cast<std::size_t>(states_) + (model_->none ? 1U : 0U);
  }
  void renew_table(std::size_t state) noexcept;
  // The variance that the source's noise and errors add to a feature of this window.
  [[nodiscard]] double added_variance(std::size_t window) const noexcept;
  void weigh(std::span<const double> measured_rad, Row& out) noexcept;
  // The same of a source with errors, by the distances from held poses.
  void weigh_held(Row& out) const noexcept;
  // Fills off_held_ from the pose of the frame before.
  void measure_held() noexcept;
  // How far the pose of the frame before is from the nearest label, as a share of the label's
  // limit; NaN: not known.
  [[nodiscard]] double off_labels() const noexcept;
  // How much more probable than the best state it is that the hand makes none of the gestures.
  [[nodiscard]] double none_margin(std::span<const double> measured_rad) noexcept;
  void advance(const Row& log_emission) noexcept;
  void step_back(const Row& ahead, Row& backward) const noexcept;

  const LiveModel* model_ = nullptr;
  int max_window_;
  double error_rad_;
  int states_ = 0;
  double log_choices_ = 0.0;  // of the number of labels that may follow a label
  double log_chains_ = 0.0;   // of the number of chains
  double pace_ = 1.0;         // the stream's rate over the model's
  double period_s_ = 0.0, noise_rad_ = 0.0;
  std::size_t next_table_ = 0;
  long pushed_ = 0;
  int even_frames_ = 0;                      // in a row, up to 2
  std::array<std::vector<double>, 2> past_;  // [channel] the last measured frames
  std::size_t features_ = 0;                 // of the model, padded to whole lanes
  std::vector<double> feature_, weight_;     // [features] of the frame that comes
  LabelRow off_held_{};                      // squared distance from each label's held pose
  std::vector<double> known_;                // [channel] newest measured value; NaN: none yet
  std::vector<Table> tables_;                // [states]
  std::vector<double> rows_;                 // [states][kTableRows][features]
  Row log_now_{};                            // forward filter, sums to 1
  std::vector<Row> forward_, likelihood_;    // rings [max_window], linear
  std::vector<Row> swept_;                   // [max_window], by frames back
  int swept_frames_ = 0;                     // number of frames in the last sweep
};

}  // namespace posed::smooth
