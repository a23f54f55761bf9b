// GestureModel: the result of training on labelled hand recordings, used by generation, the live
// smoother and the model file. A gesture has five states, left to right without skips. One decision
// tree per state and finger selects a diagonal Gaussian over that finger's features from the
// gesture and its two neighbours, so that labels that were never recorded get a Gaussian, too
// (models/gesture/README.md, "Decision trees" and "Questions and unseen labels").
//
// Units: radians per frame at `rate_hz` to the power of the window's order. Immutable after load;
// shared between threads.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/hand.hpp"

namespace posed::gesture {

inline constexpr int kStates = 5;
inline constexpr int kDeltaWindows = 3;  // static, delta, delta-delta
inline constexpr int kClasses = 3;       // A, B, C of a finger
inline constexpr int kQuestions = 3 * kClasses;

// A diagonal Gaussian over one finger's features: [window][channel of the finger].
struct FingerGaussian {
  std::array<std::array<double, kFingerChannels>, kDeltaWindows> mean{};
  std::array<std::array<double, kFingerChannels>, kDeltaWindows> variance{};
};

// Duration of each state [frames].
struct DurationGaussian {
  std::array<double, kStates> mean{};
  std::array<double, kStates> variance{};
};

// A gesture among its neighbours, as indices into GestureModel::labels. At the ends of a sequence
// the missing neighbour is the gesture itself.
struct Context {
  int previous, current, next;
};

// Inner nodes ask question 3 * position + class, position 0 previous, 1 current, 2 next: does that
// label belong to that class for this tree's finger?
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

struct Label {
  std::string name;                          // see proto/frame/label.hpp
  std::array<int, kFingers> finger_class{};  // 0 to kClasses - 1
  bool trained = false;                      // it occurs in the training recordings
};

// The class that most fingers of the label have, the lowest one in a tie. RT-safe.
[[nodiscard]] int majority_class(const Label& label) noexcept;

struct GestureModel {
  double rate_hz = 30.0;
  std::vector<Label> labels;
  std::array<std::array<Tree<FingerGaussian>, kFingers>, kStates> trees;
  Tree<DurationGaussian> durations;  // uses the class that most fingers have
  HandAngles low{}, high{};          // range of the training recordings [rad]
  std::string report_json;           // report of the training, for people

  [[nodiscard]] int label_index(std::string_view name) const noexcept;  // -1 when unknown
};

// The leaf that a finger's tree selects for a state in its context, as an index and as its
// Gaussian. `state` from 0. RT-safe.
[[nodiscard]] int leaf_index(const GestureModel& model, int state, int finger,
                             const Context& context) noexcept;
[[nodiscard]] const FingerGaussian& leaf(const GestureModel& model, int state, int finger,
                                         const Context& context) noexcept;
[[nodiscard]] const DurationGaussian& duration(const GestureModel& model,
                                               const Context& context) noexcept;

}  // namespace posed::gesture
