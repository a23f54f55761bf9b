// LabelSequencePlayer: performs labels frame by frame while they come. Each frame is the most
// likely one given the whole past, kept exactly, and the script up to `look_ahead_s`
// (models/perform/README.md, "Look-ahead player"; the label sequence is the future: no latency).
// What lies ahead is planned anew every frame: labels appended and a tempo set while it plays move
// only what is not yet shown.
//
// Started from a live hand it takes up that hand's last two poses and glides into the first
// gesture, the gesture's own pull off for the lead-in (models/perform/README.md, "Lead-in"). Angles
// in radians. Hot: no heap after construction, no locks; one thread.
#pragma once

#include <memory>
#include <vector>

#include "models/perform/label_sequence.hpp"
#include "proto/frame/hand.hpp"

namespace posed::perform {

struct PlayerOptions {
  double look_ahead_s = 1.0;
  int capacity = 1024;  // labels that wait
  // After the last label: rest in its last state until another is appended (and glide into that one
  // as out of a live hand), or end.
  bool rest = false;
};

struct PlayedFrame {
  HandAngles angle{};
  HandAngles variance{};  // of each angle, given what was known
  int label = -1;         // index into the model's labels
  int state = -1;         // 0 to 4; -1 in the lead-in and at rest
};

class LabelSequencePlayer {
 public:
  // `evidence` outlives the player's use of it; its rate is the rate of the frames.
  LabelSequencePlayer(const trajectory::StateInformation& evidence, const PlayerOptions& options);

  // False when so many labels wait already. `label` is an index into the model's labels.
  [[nodiscard]] bool append(int label) noexcept { return script_.append(label); }
  void set_loop(bool loop) noexcept { script_.set_loop(loop); }
  void set_tempo(double tempo) noexcept;  // kMinTempo to kMaxTempo, from the next state on
  void clear() noexcept;                  // forgets labels and motion

  // Begins with the first appended label: out of nothing, or out of the last two poses of a hand,
  // one frame apart. Labels must have been appended.
  void start() noexcept;
  void start(const HandAngles& before, const HandAngles& last) noexcept;

  // The next frame; false when there is none (not started, or performed to the end and not at
  // rest).
  [[nodiscard]] bool next(PlayedFrame& out) noexcept;

  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] double tempo() const noexcept { return tempo_; }

 private:
  void glide() noexcept;
  int plan(Cursor& shown) noexcept;
  void advance(int frames) noexcept;

  const trajectory::StateInformation& evidence_;
  PlayerOptions options_;
  int look_ahead_;  // frames
  LabelSequence script_;
  double tempo_ = 1.0;
  bool started_ = false, carries_ = false;
  Cursor cursor_;      // of the first frame that is not settled
  int lead_left_ = 0;  // frames of the lead-in before it
  int shown_ = 0;      // frames not settled that were given out: the last ones of a script
  HandAngles before_{}, last_{};        // the last two poses
  trajectory::InformationForm states_;  // slot 0: the lead-in's; one for each state ahead
  std::vector<const double*> frames_;
  hwy::AlignedFreeUniquePtr<double[]> carry_, factor_rows_, x_, variance_;
  std::vector<double*> factors_;
};

}  // namespace posed::perform
