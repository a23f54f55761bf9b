// LabelSequence: the labels to perform, and a cursor that walks over their states frame by frame.
// The same code plans a whole sequence and plays labels that are still being appended: later states
// are looked up anew whenever they are needed, so an appended label or a new tempo (duration scale)
// takes effect from the next state on. Hot: no heap after construction; one thread.
#pragma once

#include <vector>

#include "models/trajectory/state_information.hpp"

namespace posed::perform {

class LabelSequence {
 public:
  explicit LabelSequence(int capacity);

  // Label indices of the model; all RT-safe. append() returns false when the sequence is full.
  [[nodiscard]] bool append(int label) noexcept;
  void clear() noexcept;
  // A looped sequence starts again after its last label and forgets none.
  void set_loop(bool loop) noexcept { loop_ = loop; }

  [[nodiscard]] bool empty() const noexcept { return end_ == first_; }
  [[nodiscard]] long first() const noexcept { return first_; }
  [[nodiscard]] bool has_next(long position) const noexcept;
  // The position after this one; needs has_next().
  [[nodiscard]] long next(long position) const noexcept;
  // The label between its neighbours. A missing neighbour is the label itself.
  [[nodiscard]] gesture::Context context(long position) const noexcept;

  // Frees the space of performed labels, except the neighbour before `position`.
  void forget_before(long position) noexcept;

 private:
  [[nodiscard]] int label(long position) const noexcept {
    return labels_[static_cast<std::size_t>(position % static_cast<long>(labels_.size()))];
  }

  std::vector<int> labels_;   // ring
  long first_ = 0, end_ = 0;  // positions only ever increase
  bool loop_ = false;
};

// The place of a performance: its label, state and remaining frames of that state.
struct Cursor {
  long position = 0;
  int state = 0;
  int frames = 0;        // duration of this state
  int frames_left = 0;   // remaining ones, including the current frame; 0: the sequence is finished
  double carried = 0.0;  // frames lost to rounding so far
};

// Moves to the first state of `position`.
RT_SAFE [[nodiscard]] Cursor enter(const LabelSequence& script,
                                   const trajectory::StateInformation& information, long position,
                                   double tempo) noexcept;

// Advances by one frame; frames_left is 0 after the last one, until a label is appended.
RT_SAFE void step(Cursor& cursor, const LabelSequence& script,
                  const trajectory::StateInformation& information, double tempo) noexcept;

}  // namespace posed::perform
