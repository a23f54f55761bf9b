// LabelSequencePlayer: performs labels frame by frame while more are being added. Each frame is
// the most likely one given the exact past and the label sequence up to `look_ahead_s` ahead
// (models/perform/README.md, "Look-ahead player"). Because the future is the label sequence, there
// is no latency. The frames ahead are planned anew in every frame, so labels added and a tempo
// set while it plays affect only frames that are not shown yet.
//
// Started from a live hand or body, it continues its last two poses and moves smoothly into the
// first gesture; during this lead-in the gesture's own pull is off (models/perform/README.md,
// "Lead-in"). A pose has the channels of the model in use, in radians. Hot: no heap after
// construction, no locks; one thread.
#pragma once

#include <span>
#include <vector>

#include "models/perform/label_sequence.hpp"
#include "models/perform/shown_pose.hpp"
#include "models/trajectory/information_form.hpp"

namespace posed::perform {

struct PlayerOptions {
  double look_ahead_s = 1.0;
  int capacity = 1024;  // most labels that wait
  // After the last label: true: rest in its last state until another is appended (with a lead-in as
  // from a live hand); false: end.
  bool rest = false;
};

struct PlayedFrame {
  // [channel of the model], valid until the player's next call
  std::span<const double> angle{};
  std::span<const double> variance{};  // posterior variance of each angle [rad^2]
  int label = -1;                      // index into the model's labels
  int state = -1;                      // 0 to 4; -1 in the lead-in and at rest
};

class LabelSequencePlayer {
 public:
  // Without a model until the first use(), for models of at most `channels` channels.
  LabelSequencePlayer(double rate_hz, int channels, const PlayerOptions& options);
  // `information` must outlive its use here; its rate is the frame rate.
  LabelSequencePlayer(const trajectory::StateInformation& information,
                      const PlayerOptions& options);

  // Returns false when `capacity` labels already wait. `label` is an index into the model's labels.
  [[nodiscard]] bool add(int label) noexcept { return script_.append(label); }
  void set_loop(bool loop) noexcept { script_.set_loop(loop); }
  void set_tempo(
      double tempo) noexcept;  // clamped to gesture::kMinTempo..kMaxTempo; from the next state on
  void clear() noexcept;       // forgets all labels and the motion
  // Another model of the same rate, with no more channels than allocated for: forgets all labels
  // and the motion, too.
  void use(const trajectory::StateInformation& information) noexcept;

  // Starts with the first added label: without a past, or from the last two poses shown, one frame
  // apart. At least one label must have been added.
  void start() noexcept;
  void start(std::span<const double> before, std::span<const double> last) noexcept;

  // The next frame; returns false when there is none (not started, or at the end and not resting).
  [[nodiscard]] bool next(PlayedFrame& out) noexcept;

  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] double tempo() const noexcept { return tempo_; }

 private:
  void begin(const trajectory::StateInformation& information) noexcept;
  [[nodiscard]] double* slot(int index) noexcept;
  void glide() noexcept;
  int plan(Cursor& shown) noexcept;
  void advance(int frames) noexcept;

  const trajectory::StateInformation* information_ = nullptr;
  PlayerOptions options_;
  int look_ahead_;  // frames
  LabelSequence script_;
  ShownPose shown_pose_;
  double tempo_ = 1.0;
  bool started_ = false, carries_ = false;
  Cursor cursor_;      // of the first frame that is not final
  int lead_left_ = 0;  // remaining frames of the lead-in before it
  int shown_ = 0;      // frames already shown but not final (only at the end of a sequence)
  int channels_ = 0, stride_ = 0;  // of the model in use
  // All of these are allocated for the most channels, and used with the model's stride.
  trajectory::Rows before_, last_;  // the last two poses, without the offset of a shown one
  trajectory::Rows out_;            // with it
  trajectory::Rows states_;         // slots of information, 0: lead-in; then one a state ahead
  trajectory::Rows carry_, factor_rows_, x_, variance_;
  std::vector<const double*> frames_;
  std::vector<double*> factors_;
};

}  // namespace posed::perform
