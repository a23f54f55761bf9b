// LabelSequence: the labels to perform, and a cursor that walks over their states frame by frame.
// The same code plans a whole string and plays labels that are still coming: what lies ahead is
// looked up anew whenever it is asked for, so an appended label or a new tempo counts from the next
// state on. Hot: no heap after construction; one thread.
#pragma once

#include <array>
#include <vector>

#include "models/trajectory/state_information.hpp"

namespace posed::perform {

class LabelSequence {
 public:
  explicit LabelSequence(int capacity);

  // Label indices of the model; all RT-safe. append() is false when the script is full.
  [[nodiscard]] bool append(int label) noexcept;
  void clear() noexcept;
  // A looped script begins anew after its last label and forgets none.
  void set_loop(bool loop) noexcept { loop_ = loop; }

  [[nodiscard]] bool empty() const noexcept { return end_ == first_; }
  [[nodiscard]] long first() const noexcept { return first_; }
  [[nodiscard]] bool has_next(long position) const noexcept;
  // The position after this one; needs has_next().
  [[nodiscard]] long next(long position) const noexcept;
  // The label between its neighbours. A missing neighbour is the label itself.
  [[nodiscard]] gesture::Context context(long position) const noexcept;

  // Gives back the room of what was performed, but for the neighbour before `position`.
  void forget_before(long position) noexcept;

 private:
  [[nodiscard]] int label(long position) const noexcept {
    return labels_[static_cast<std::size_t>(position % static_cast<long>(labels_.size()))];
  }

  std::vector<int> labels_;   // ring
  long first_ = 0, end_ = 0;  // positions count on for ever
  bool loop_ = false;
};

// Where a performance is: in which state of which label, and for how many frames more.
struct Cursor {
  long position = 0;
  int state = 0;
  int frames = 0;        // that this state lasts
  int frames_left = 0;   // of them, this one included; 0: the script is performed
  double carried = 0.0;  // what rounding took so far, in frames
};

// At the first state of `position`. RT-safe.
[[nodiscard]] Cursor enter(const LabelSequence& script,
                           const trajectory::StateInformation& evidence, long position,
                           double tempo) noexcept;

// One frame on; frames_left is 0 after the last, until a label is appended. RT-safe.
void step(Cursor& cursor, const LabelSequence& script, const trajectory::StateInformation& evidence,
          double tempo) noexcept;

}  // namespace posed::perform
