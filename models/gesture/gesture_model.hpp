// GestureModel: the result of training on labelled recordings of a hand or a body, used by
// generation, the live smoother and the model file. A gesture has five states, left to right
// without skips. One decision tree per state and group of channels (a finger, an arm) selects a
// diagonal Gaussian over that group's features from the gesture and its two neighbours, so that
// labels that were never recorded get a Gaussian, too (models/gesture/README.md, "Decision trees"
// and "Questions and unseen labels").
//
// Units: radians per frame at `rate_hz` to the power of the window's order. Immutable after load;
// shared between threads.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "models/gesture/vocabulary.hpp"

namespace posed::gesture {

inline constexpr int kStates = 5;
inline constexpr int kDeltaWindows = 3;  // static, delta, delta-delta
// The longest that a state, and a gesture that is learnt, may last: a pose that is held for longer
// is no gesture, and performing one would fill the memory.
inline constexpr double kMaxState_s = 600.0;

// A diagonal Gaussian over one group's features: [window][channel of the group].
struct GroupGaussian {
  std::array<std::vector<double>, kDeltaWindows> mean{};
  std::array<std::vector<double>, kDeltaWindows> variance{};
};

// Duration of each state [frames].
struct DurationGaussian {
  std::array<double, kStates> mean{};
  std::array<double, kStates> variance{};
};

// A gesture among its neighbours, as indices into Vocabulary::labels. At the ends of a sequence the
// missing neighbour is the gesture itself.
struct Context {
  int previous, current, next;
};

// Inner nodes ask question n * position + statement, position 0 previous, 1 current, 2 next: does
// that of the tree's n statements hold for that label (Vocabulary::holds)?
struct TreeNode {
  int question = -1;  // -1: a leaf
  int yes = -1, no = -1;
  int leaf = -1;  // index of the leaf's Gaussian
};

template <typename Gaussian>
struct Tree {
  std::vector<TreeNode> nodes;  // node 0 is the root
  std::vector<Gaussian> leaves;
  std::vector<double> occupancy;  // [leaf] training frames in the leaf (duration tree: gestures)
};

// Where the recorded labels are held, and how far from there a held pose still is that gesture
// (models/gesture/README.md, "None"). The distance of a pose x from a label is |W (x - mean)|^2.
struct HeldPoses {
  std::vector<std::vector<double>> mean;  // [recorded label][channel] rad
  std::vector<double> whitening;          // W, a lower triangle row by row [1/rad]
  std::vector<double> limit;              // [recorded label] of the distance
  int people = 1;  // left out of training one at a time for the limits; 1: one person's takes were
};

struct GestureModel : Vocabulary {
  double rate_hz = 30.0;
  std::array<std::vector<Tree<GroupGaussian>>, kStates> trees;  // [state][group]
  Tree<DurationGaussian> durations;                             // asks what kDurations states
  std::vector<double> low, high;  // [channel] range of the training recordings [rad]
  std::optional<HeldPoses> held;  // of a model of hands that tells what is none, or a camera's
  std::string report_json;        // report of the training, for people
};

// The leaf that a group's tree selects for a state in its context, as an index and as its
// Gaussian. `state` from 0.
RT_SAFE [[nodiscard]] int leaf_index(const GestureModel& model, int state, int group,
                                     const Context& context) noexcept;
[[nodiscard]] const GroupGaussian& leaf(const GestureModel& model, int state, int group,
                                        const Context& context) noexcept;
[[nodiscard]] const DurationGaussian& duration(const GestureModel& model,
                                               const Context& context) noexcept;

}  // namespace posed::gesture
