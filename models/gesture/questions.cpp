#include "models/gesture/questions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "proto/frame/degree.hpp"
#include "proto/frame/label.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

constexpr int kRounds = 50;                        // of k-means; a few labels converge in three
constexpr double kSameClass_rad = 15.0 * kDegree;  // rms over a group's joints within a class

using Finger = std::array<double, kFingerChannels>;

Finger finger_of(const std::vector<double>& angles, int finger) {
  Finger out{};
  std::copy_n(angles.begin() + finger * kFingerChannels, kFingerChannels, out.begin());
  return out;
}

double distance(const Finger& a, const Finger& b) {
  double sum = 0.0;
  for (int c = 0; c < kFingerChannels; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return std::sqrt(sum);
}

double flexion(const Finger& finger) { return finger[0] + finger[3] + finger[6]; }

int nearest(const Finger& finger, const std::vector<Finger>& centres) {
  int best = 0;
  for (int k = 1; k < static_cast<int>(centres.size()); ++k) {
    if (distance(finger, centres[k]) < distance(finger, centres[best])) best = k;
  }
  return best;
}

// Start centres: the most closed pose, then repeatedly the pose farthest from all chosen ones.
std::vector<Finger> first_centres(const std::vector<Finger>& poses) {
  std::vector<Finger> centres{*std::ranges::max_element(poses, {}, flexion)};
  while (centres.size() < std::min<std::size_t>(kClasses, poses.size())) {
    centres.push_back(*std::ranges::max_element(poses, {}, [&](const Finger& pose) {
      return distance(pose, centres[nearest(pose, centres)]);
    }));
  }
  return centres;
}

// The class of every pose; class 0 is the most closed.
std::vector<int> cluster(const std::vector<Finger>& poses) {
  std::vector<Finger> centres = first_centres(poses);
  std::vector<int> member(poses.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < poses.size(); ++i) member[i] = nearest(poses[i], centres);
    for (int k = 0; k < static_cast<int>(centres.size()); ++k) {
      Finger sum{};
      double count = 0.0;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        if (member[i] != k) continue;
        count += 1.0;
        for (int c = 0; c < kFingerChannels; ++c) sum[c] += poses[i][c];
      }
      if (count == 0.0) continue;
      for (int c = 0; c < kFingerChannels; ++c) centres[k][c] = sum[c] / count;
    }
  }
  std::vector<int> order(centres.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int k) { return std::pair(-flexion(centres[k]), k); });
  std::vector<int> rank(centres.size());
  for (int r = 0; r < static_cast<int>(order.size()); ++r) rank[order[r]] = r;
  for (int& k : member) k = rank[k];
  return member;
}

std::string class_name(int index) { return {static_cast<char>('A' + index)}; }

// "A, B or C"
std::string class_names(int classes) {
  std::string names = class_name(0);
  for (int k = 1; k < classes; ++k) names += (k + 1 < classes ? ", " : " or ") + class_name(k);
  return names;
}

// The class of the group that contains the label; an error when there is none or more than one.
Result<int> class_of(const std::vector<std::vector<std::string>>& classes,
                     const ChannelGroup& group, const std::string& name) {
  int found = -1;
  for (int k = 0; k < static_cast<int>(classes.size()); ++k) {
    if (std::ranges::count(classes[k], name) == 0) continue;
    if (found >= 0) {
      return fail("label " + in_quotes(name) + " is in the classes " + class_name(found) + " and " +
                  class_name(k) + " of the " + group.name +
                  "; a finger, or group, of a gesture is of one class");
    }
    found = k;
  }
  if (found < 0) {
    return fail("label " + in_quotes(name) + " is in no class of the " + group.name +
                "; add it to " + class_names(static_cast<int>(classes.size())) + " of [" +
                group.name + "]");
  }
  return found;
}

double distance(const LabelPose& a, const LabelPose& b, const ChannelGroup& group) {
  double sum = 0.0;
  for (int c = group.first; c < group.first + group.channels; ++c) {
    const double off = a.angles_rad[c] - b.angles_rad[c];
    sum += off * off;
  }
  return std::sqrt(sum);
}

// The pose with the least sum of distances to all others.
std::size_t most_central(const std::vector<LabelPose>& poses, const ChannelGroup& group) {
  const auto sum_to = [&](std::size_t i) {
    double sum = 0.0;
    for (const LabelPose& other : poses) sum += distance(poses[i], other, group);
    return sum;
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (sum_to(i) < sum_to(best)) best = i;
  }
  return best;
}

}  // namespace

Result<std::vector<Label>> labels_of(const ClassLists& lists,
                                     const std::vector<ChannelGroup>& groups) {
  std::vector<Label> labels;
  for (const auto& group : lists) {
    for (const auto& names : group) {
      for (const std::string& name : names) {
        if (!is_label_name(name)) {
          return fail(in_quotes(name) + " is no label; use 1 to 15 signs of ASCII without a blank");
        }
        const auto same = [&](const Label& label) { return label.name == name; };
        if (std::ranges::none_of(labels, same)) labels.push_back({.name = name});
      }
    }
  }
  for (Label& label : labels) {
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto found = TRY(class_of(lists[g], groups[g], label.name));
      label.group_class.push_back(found);
    }
  }
  return labels;
}

ClassLists lists_of(const std::vector<Label>& labels, const std::vector<ChannelGroup>& groups) {
  ClassLists lists;
  for (const ChannelGroup& group : groups) {
    lists.emplace_back(static_cast<std::size_t>(group.classes));
  }
  for (const Label& label : labels) {
    for (std::size_t g = 0; g < groups.size(); ++g) {
      lists[g][label.group_class[g]].push_back(label.name);
    }
  }
  return lists;
}

const std::vector<Label>& built_in_labels() {
  static const std::vector<Label> labels{
      {.name = "g", .group_class = {0, 0, 0, 0, 0}}, {.name = "c", .group_class = {1, 1, 1, 1, 1}},
      {.name = "p", .group_class = {2, 2, 2, 2, 2}}, {.name = "1", .group_class = {0, 2, 0, 0, 0}},
      {.name = "3", .group_class = {0, 2, 2, 2, 0}}, {.name = "4", .group_class = {0, 2, 2, 2, 2}}};
  return labels;
}

Vocabulary built_in_vocabulary() {
  Vocabulary vocabulary;
  vocabulary.labels = built_in_labels();
  return vocabulary;
}

std::vector<Label> propose_labels(const std::vector<LabelPose>& poses) {
  std::vector<Label> labels;
  labels.reserve(poses.size());
  for (const LabelPose& pose : poses) labels.push_back({.name = pose.name});
  for (int f = 0; f < kFingers && !poses.empty(); ++f) {
    std::vector<Finger> fingers;
    fingers.reserve(poses.size());
    for (const LabelPose& pose : poses) fingers.push_back(finger_of(pose.angles_rad, f));
    const std::vector<int> classes = cluster(fingers);
    for (std::size_t i = 0; i < poses.size(); ++i) labels[i].group_class.push_back(classes[i]);
  }
  return labels;
}

void propose_body_labels(const std::vector<LabelPose>& poses, Vocabulary& vocabulary) {
  vocabulary.labels.clear();
  for (const LabelPose& pose : poses) vocabulary.labels.push_back({.name = pose.name});
  for (ChannelGroup& group : vocabulary.groups) {
    // Each further class begins with the pose that is farthest from all classes so far.
    std::vector<std::size_t> centres{most_central(poses, group)};
    const auto nearest_centre = [&](std::size_t i) {
      return std::ranges::min_element(centres, {}, [&](std::size_t centre) {
        return distance(poses[i], poses[centre], group);
      });
    };
    const double alike_rad = kSameClass_rad * std::sqrt(group.channels / 3.0);
    while (centres.size() < kMaxClasses) {
      std::size_t farthest = 0;
      double most_rad = 0.0;
      for (std::size_t i = 0; i < poses.size(); ++i) {
        const double off_rad = distance(poses[i], poses[*nearest_centre(i)], group);
        if (off_rad > most_rad) most_rad = off_rad, farthest = i;
      }
      if (most_rad <= alike_rad) break;
      centres.push_back(farthest);
    }
    group.classes = static_cast<int>(centres.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const auto place = nearest_centre(i) - centres.begin();
      vocabulary.labels[i].group_class.push_back(static_cast<int>(place));
    }
  }
}

Label label_like(const LabelPose& shown, const std::vector<LabelPose>& trained,
                 const std::vector<Label>& labels, const std::vector<ChannelGroup>& groups) {
  Label label{.name = shown.name, .group_class = std::vector<int>(groups.size())};
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double best = std::numeric_limits<double>::infinity();
    for (const LabelPose& pose : trained) {
      const double off = distance(pose, shown, groups[g]);
      const auto like = std::ranges::find(labels, pose.name, &Label::name);
      if (off >= best || like == labels.end()) continue;
      best = off;
      label.group_class[g] = like->group_class[g];
    }
  }
  return label;
}

double composed_off_rad(const LabelPose& shown, const std::vector<LabelPose>& trained,
                        const std::vector<ChannelGroup>& groups) {
  double sum = 0.0;
  for (const ChannelGroup& group : groups) {
    double best = std::numeric_limits<double>::infinity();
    for (const LabelPose& pose : trained) best = std::min(best, distance(pose, shown, group));
    sum += best * best;
  }
  return std::sqrt(sum / static_cast<double>(shown.angles_rad.size()));
}

}  // namespace posed::gesture
