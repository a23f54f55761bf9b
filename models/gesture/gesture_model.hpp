// GestureModel: what training makes of a labelled hand recording, and all that generation, the
// live generator and the model file need. Five states a gesture, left to right without skips; one
// decision tree per state and finger picks a diagonal Gaussian over that finger's features from
// the gesture and its two neighbours, so that labels that were never recorded are answered too
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

// Frames that each state lasts.
struct DurationGaussian {
  std::array<double, kStates> mean{};
  std::array<double, kStates> variance{};
};

// A gesture among its neighbours, as indices into GestureModel::labels. At the edges of a string
// the missing neighbour is the gesture itself.
struct Context {
  int previous, current, next;
};

// Inner nodes ask question 3 * position + class, position 0 previous, 1 current, 2 next: is that
// label of that class for this tree's finger?
struct TreeNode {
  int question = -1;  // -1: a leaf
  int yes = -1, no = -1;
  int leaf = -1;  // index of the leaf's Gaussian
};

template <typename Gaussian>
struct Tree {
  std::vector<TreeNode> nodes;  // node 0 is the root
  std::vector<Gaussian> leaves;
  std::vector<double> occupancy;  // [leaf] training frames in it (duration tree: gestures)
};

struct Label {
  std::string name;                          // see proto/frame/label.hpp
  std::array<int, kFingers> finger_class{};  // 0 to kClasses - 1
  bool trained = false;                      // it was in the recordings
};

// The class that most fingers of the label have, the lowest where they tie. RT-safe.
[[nodiscard]] int majority_class(const Label& label) noexcept;

struct GestureModel {
  double rate_hz = 30.0;
  std::vector<Label> labels;
  std::array<std::array<Tree<FingerGaussian>, kFingers>, kStates> trees;
  Tree<DurationGaussian> durations;  // asked with the class that most fingers have
  HandAngles low{}, high{};          // range of the training recordings [rad]
  std::string report_json;           // how it was made, for people

  [[nodiscard]] int label_index(std::string_view name) const noexcept;  // -1 when unknown
};

// The index of the leaf, and the Gaussian, that a finger's tree gives a state in its context.
// `state` from 0. RT-safe.
[[nodiscard]] int leaf_index(const GestureModel& model, int state, int finger,
                             const Context& context) noexcept;
[[nodiscard]] const FingerGaussian& leaf(const GestureModel& model, int state, int finger,
                                         const Context& context) noexcept;
[[nodiscard]] const DurationGaussian& duration(const GestureModel& model,
                                               const Context& context) noexcept;

}  // namespace posed::gesture
