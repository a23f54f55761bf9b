#include "models/gesture/vocabulary.hpp"

#include <algorithm>
#include <array>

namespace posed::gesture {

const std::vector<ChannelGroup>& finger_groups() {
  static const std::vector<ChannelGroup> groups = [] {
    std::vector<ChannelGroup> fingers;
    fingers.reserve(kFingers);
    for (int f = 0; f < kFingers; ++f) {
      fingers.push_back({std::string(kFingerNames[f]), f * kFingerChannels, kFingerChannels});
    }
    return fingers;
  }();
  return groups;
}

int majority_class(const Label& label) noexcept {
  std::array<int, kMaxClasses> votes{};
  for (const int group_class : label.group_class) ++votes[group_class];
  return static_cast<int>(std::max_element(votes.begin(), votes.end()) - votes.begin());
}

int Vocabulary::channels() const noexcept { return groups.back().first + groups.back().channels; }

int Vocabulary::label_index(std::string_view name) const noexcept {
  const auto found = std::find_if(labels.begin(), labels.end(),
                                  [&](const Label& label) { return label.name == name; });
  return found == labels.end() ? -1 : static_cast<int>(found - labels.begin());
}

RT_SAFE int Vocabulary::statements(int group) const noexcept {
  int classes = 0;
  if (group != kDurations) {
    classes = groups[group].classes;
  } else if (is_hand()) {
    for (const ChannelGroup& finger : groups) classes = std::max(classes, finger.classes);
  } else {
    for (const ChannelGroup& part : groups) classes += part.classes;
  }
  return classes + static_cast<int>(named.size());
}

RT_SAFE bool Vocabulary::holds(int group, int statement, int label) const noexcept {
  const int classes = statements(group) - static_cast<int>(named.size());
  if (statement >= classes) return named[statement - classes] == label;
  if (group != kDurations) return labels[label].group_class[group] == statement;
  if (is_hand()) return majority_class(labels[label]) == statement;
  int of_group = 0;
  while (statement >= groups[of_group].classes) statement -= groups[of_group++].classes;
  return labels[label].group_class[of_group] == statement;
}

}  // namespace posed::gesture
