// Vocabulary: the labels that a gesture model knows, and what its trees may ask about them. The
// channels of a pose stand in groups, which have trees of their own: the five fingers of a hand, or
// parts of a body such as an arm. In each group a label belongs to one class, so that a gesture
// that was never recorded can be composed group by group (models/gesture/README.md, "Questions and
// unseen labels"). Made cold, then const.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/motion/pose_space.hpp"
#include "proto/frame/hand.hpp"

namespace posed::gesture {

inline constexpr int kClasses = 3;      // A, B, C of a finger
inline constexpr int kMaxClasses = 26;  // A to Z of a group of joints
inline constexpr int kMaxGroups = 16;

// Channels [first, first + channels) of a pose.
struct ChannelGroup {
  std::string name;
  int first = 0, channels = 0;
  int classes = kClasses;
};

// A hand's five fingers of nine channels.
[[nodiscard]] const std::vector<ChannelGroup>& finger_groups();

struct Label {
  std::string name;                // see proto/frame/label.hpp
  std::vector<int> group_class{};  // [group] from 0
  bool trained = false;            // it occurs in the training recordings
  std::vector<double> shown{};  // [channel] the held pose as it was shown [rad]; empty: it was not
};

// The class of a finger's label that most fingers have, the lowest one in a tie.
RT_SAFE [[nodiscard]] int majority_class(const Label& label) noexcept;

struct Vocabulary {
  // A body's joints, group by group, with the rotations about which its channels are rotation
  // vectors; empty: the 45 angles of a hand (hand45).
  std::optional<motion::PoseSpaceSpec> body;
  std::vector<ChannelGroup> groups = finger_groups();
  std::vector<Label> labels;
  std::vector<int> named;  // labels that questions may name, so that equal classes stay apart
  // Whether the live smoother may say that a hand makes none of the gestures; for a body it always
  // may.
  bool tells_none = false;

  [[nodiscard]] bool is_hand() const noexcept { return !body; }
  [[nodiscard]] int channels() const noexcept;
  [[nodiscard]] int label_index(std::string_view name) const noexcept;  // -1 when unknown

  // What a question can state of a label, counted from 0: for a group, that the label is of a
  // class, then that it is a named one. kDurations for the tree of durations: of a hand the class
  // that most fingers have, of a body the classes of each group. RT-safe.
  static constexpr int kDurations = -1;
  [[nodiscard]] int statements(int group) const noexcept;
  [[nodiscard]] bool holds(int group, int statement, int label) const noexcept;
};

}  // namespace posed::gesture
