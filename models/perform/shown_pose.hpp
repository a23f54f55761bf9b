// ShownPose: a label whose pose was shown is held as it was shown, with the timing and transitions
// of the trees: an offset on the performed pose that comes and goes smoothly
// (models/perform/README.md, "Shown poses"). Hot: no heap after construction.
#pragma once

#include "models/trajectory/information_form.hpp"
#include "models/trajectory/state_information.hpp"

namespace posed::perform {

class ShownPose {
 public:
  // For models of at most `channels` channels.
  explicit ShownPose(int channels);

  // No label is performed yet. `poses`: the motion begins in the first label's pose; false: it
  // comes from a pose of its own, which has no offset.
  RT_SAFE void restart(bool poses) noexcept;

  // Once a frame, in order: moves on to the offset of the next frame. `position` is the place of
  // its label among those that are performed, `context` the label between its neighbours. `held` is
  // the pose that the label comes to rest in, where that is known; nullptr: the mean of its state.
  RT_SAFE void advance(const trajectory::StateInformation& information, long position,
                       const gesture::Context& context, double tempo,
                       const double* held = nullptr) noexcept;

  // Of a channel in this frame [rad].
  RT_SAFE [[nodiscard]] double offset_rad(int channel) const noexcept { return now_[channel]; }

 private:
  void aim(const trajectory::StateInformation& information, const gesture::Context& context,
           double tempo, const double* held) noexcept;

  int most_;
  trajectory::Rows goal_, from_, speed_, now_, scratch_;  // of the offset; speed_ per ramp
  long position_ = -1;                                    // of the label that the ramp is for
  bool at_once_ = false, moves_ = false;
  int frame_ = 0, frames_ = 1;  // of the ramp
};

}  // namespace posed::perform
