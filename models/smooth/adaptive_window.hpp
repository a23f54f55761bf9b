// AdaptiveWindow: the windowed solve with the speed-adaptive prior (models/smooth/README.md,
// "Speed-adaptive prior") for a row of channels; it needs no gesture model. The window is solved
// once under a loose prior for the acceleration, then twice more under priors whose variances
// follow the speed found by the previous solve, and are small where the motion is steady. What left
// the window is carried on into the solve.
//
// Units: radians and seconds; frames may be evenly spaced or not. Hot parts are RT-safe and never
// allocate; one thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "models/smooth/steady_motion.hpp"
#include "models/trajectory/carried_past.hpp"
#include "models/trajectory/information_form.hpp"
#include "models/trajectory/sliding_window.hpp"

namespace posed::smooth {

// Frames in the window at a frame period: 26 up to 60 Hz, 0.43 s above. RT-safe.
inline constexpr int kMaxWindow = 434;  // at 1000 Hz
[[nodiscard]] int window_frames(double period_s) noexcept;

class AdaptiveWindow;

// An additional source of information about the window's frames: add() is called before each solve
// but the first and may use the result of the previous solve. RT-safe.
class InformationSource {
 public:
  InformationSource() = default;
  InformationSource(const InformationSource&) = delete;
  InformationSource& operator=(const InformationSource&) = delete;
  virtual ~InformationSource() = default;

  virtual void add(AdaptiveWindow& window) noexcept = 0;
};

// What is known of the sensors whose values a frame shows.
struct Sensors {
  double noise_rad = 0.0;
  double jitter_rad =
      0.0;  // the noise as far as it shows from frame to frame; 0: no jumps are told
  std::span<const double> share{};          // [channels] of both for each channel; empty: 1
  std::span<const double> rounding_rad{};   // [channels] error of rounding; empty: none
  std::span<const double> half_step_rad{};  // [channels] finite where nothing but rounding disturbs
  bool repeated = false;  // the frame shows the samples of the one before once more: none is new
  std::span<const std::uint8_t> again{};  // [channels] 1: the same of one channel; empty: of none
};

class AdaptiveWindow {
 public:
  explicit AdaptiveWindow(int channels);

  // The next frame: [channels] rad, NaN where a channel is missing. Times increase.
  void push(double time_s, std::span<const double> measured_rad, const Sensors& sensors) noexcept;

  // Solves the last frames: window_frames(period_s) of them, or up to an eighth more, because a
  // period that grows by less does not shorten the window.
  void solve(double period_s, InformationSource* extra = nullptr) noexcept;

  // One solve under the loose prior alone; the benchmark compares the full solve with it.
  void solve_once(double period_s) noexcept;

  void reset() noexcept;

  // Results of the last solve for the frame `back` frames before the newest; `back` is below
  // frames().
  [[nodiscard]] int frames() const noexcept { return frames_; }
  [[nodiscard]] const double* x(int back) const noexcept { return window_.x(frames_ - 1 - back); }
  // out: [stride()], 64-byte aligned
  void variance(int back, double* out) const noexcept { window_.variance(frames_ - 1 - back, out); }
  // The frame's rows (InformationForm) for the next solve. Only InformationSource writes them.
  [[nodiscard]] double* row(int back, trajectory::Row row) noexcept {
    return information_.row(slot(frames_ - 1 - back), row);
  }
  [[nodiscard]] bool measured(int back, int channel) const noexcept {
    return sensed(slot(frames_ - 1 - back))[channel] > kNothing;
  }
  // Whether all channels of that frame were measured.
  [[nodiscard]] bool whole(int back) const noexcept {
    return whole_[slot(frames_ - 1 - back)] != 0;
  }
  // Time between that frame and the newest [s].
  [[nodiscard]] double age_s(int back) const noexcept {
    return time_s_[frames_ - 1] - time_s_[frames_ - 1 - back];
  }
  // Whether the channel was measured in at least one of the window's frames.
  [[nodiscard]] bool known(int channel) const noexcept;

  [[nodiscard]] int stride() const noexcept { return information_.stride(); }

 private:
  [[nodiscard]] int slot(int index) const noexcept;  // ring position of the window's frame
  [[nodiscard]] const double* sensed(int slot) const noexcept {
    return sensed_.data() + static_cast<std::ptrdiff_t>(2 * slot) * stride();
  }
  void copy_sensed(int slot) noexcept;
  void forget_extra() noexcept;
  void find_jumps(std::span<const double> measured_rad, const Sensors& sensors) noexcept;
  void allow_jumps(int index) noexcept;
  [[nodiscard]] double* jump_row(int slot) noexcept {
    return jump_.get() + static_cast<std::ptrdiff_t>(slot) * stride();
  }
  void adopt(std::size_t channel, double value_rad) noexcept;
  void begin(double period_s) noexcept;
  void loose_prior() noexcept;
  void speed_prior() noexcept;
  void run(const trajectory::Carry& carry) noexcept;
  [[nodiscard]] double delta_delta_time_s3(int index) const noexcept;

  static constexpr double kNothing = 3.3e-6;  // precision of a value that was not measured [rad^-2]

  int channels_;
  long pushed_ = 0;
  int frames_ = 0;  // of the window
  int length_ = 0;  // its frames once so many have come
  double period_s_ = 0.0;
  bool extra_ = false;  // the window's position rows hold more than measurements
  bool even_ = true;    // the window's frames are evenly spaced
  trajectory::InformationForm information_;  // ring
  std::vector<double> sensed_;  // the same ring: kPosition and kPositionMean as measured
  trajectory::SlidingWindow window_;
  trajectory::CarriedPast past_;
  SteadyMotion steady_;
  trajectory::Rows jump_;                       // [kMaxWindow][stride] ring, see find_jumps
  std::vector<std::uint8_t> jumps_;             // [kMaxWindow] ring: some channel's is above zero
  int since_repeated_ = 0;                      // frames, up to kMaxSinceRepeated
  std::vector<double> recent_rad_;              // [2][channels] values of the last two frames
  std::vector<std::uint8_t> whole_;             // [kMaxWindow] ring
  std::vector<double> ring_time_s_;             // [kMaxWindow]
  std::vector<long> last_measured_;             // [channels] number of the frame; -1: never
  std::vector<double> held_rad_;                // [channels] the last measured value
  std::vector<double> variance_rad2_;           // [channels] of the newest measurement
  trajectory::Rows active_;                     // [stride] 1 for channels that have ever changed
  trajectory::Rows speeds_;                     // [kMaxWindow + 1][stride]
  trajectory::Rows density_;                    // [stride] of the newest frames, see Prior
  std::vector<double> hand_speeds_;             // [kMaxWindow + 1]
  std::vector<double> time_s_, step_s_, skew_;  // [kMaxWindow] of the window's frames
  std::vector<const double*> rows_;             // [kMaxWindow]
};

}  // namespace posed::smooth
