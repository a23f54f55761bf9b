#include "models/gesture/questions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "proto/frame/label.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

constexpr int kRounds = 50;  // of k-means; a few labels converge in three
constexpr const char* kClassNames = "ABC";

using Finger = std::array<double, kFingerChannels>;

Finger finger_of(const HandAngles& angles, int finger) {
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

std::string finger_word(int finger) { return std::string(kFingerNames[finger]); }

// The class of the finger that contains the label; an error when there is none or more than one.
Result<int> class_of(const ClassLists& lists, int finger, const std::string& name) {
  int found = -1;
  for (int k = 0; k < kClasses; ++k) {
    if (std::ranges::count(lists[finger][k], name) == 0) continue;
    if (found >= 0) {
      return fail("label " + in_quotes(name) + " is in the classes " + kClassNames[found] +
                  " and " + kClassNames[k] + " of the " + finger_word(finger) +
                  "; a finger of a gesture is of one class");
    }
    found = k;
  }
  if (found < 0) {
    return fail("label " + in_quotes(name) + " is in no class of the " + finger_word(finger) +
                "; add it to A, B or C of [" + finger_word(finger) + "]");
  }
  return found;
}

}  // namespace

Result<std::vector<Label>> labels_of(const ClassLists& lists) {
  std::vector<Label> labels;
  for (const auto& finger : lists) {
    for (const auto& names : finger) {
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
    for (int f = 0; f < kFingers; ++f) {
      const auto found = class_of(lists, f, label.name);
      if (!found) return std::unexpected(found.error());
      label.finger_class[f] = *found;
    }
  }
  return labels;
}

ClassLists lists_of(const std::vector<Label>& labels) {
  ClassLists lists;
  for (const Label& label : labels) {
    for (int f = 0; f < kFingers; ++f) lists[f][label.finger_class[f]].push_back(label.name);
  }
  return lists;
}

const std::vector<Label>& built_in_labels() {
  static const std::vector<Label> labels{{.name = "g", .finger_class = {0, 0, 0, 0, 0}},
                                         {.name = "c", .finger_class = {1, 1, 1, 1, 1}},
                                         {.name = "p", .finger_class = {2, 2, 2, 2, 2}},
                                         {.name = "1", .finger_class = {0, 2, 0, 0, 0}},
                                         {.name = "3", .finger_class = {0, 2, 2, 2, 0}},
                                         {.name = "4", .finger_class = {0, 2, 2, 2, 2}}};
  return labels;
}

std::vector<Label> propose_labels(const std::vector<LabelPose>& poses) {
  std::vector<Label> labels(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) labels[i].name = poses[i].name;
  for (int f = 0; f < kFingers && !poses.empty(); ++f) {
    std::vector<Finger> fingers;
    fingers.reserve(poses.size());
    for (const LabelPose& pose : poses) fingers.push_back(finger_of(pose.angles_rad, f));
    const std::vector<int> classes = cluster(fingers);
    for (std::size_t i = 0; i < poses.size(); ++i) labels[i].finger_class[f] = classes[i];
  }
  return labels;
}

Label label_like(const LabelPose& shown, const std::vector<LabelPose>& trained,
                 const std::vector<Label>& labels) {
  Label label{.name = shown.name};
  for (int f = 0; f < kFingers; ++f) {
    double best = std::numeric_limits<double>::infinity();
    for (const LabelPose& pose : trained) {
      const double off = distance(finger_of(pose.angles_rad, f), finger_of(shown.angles_rad, f));
      const auto like = std::ranges::find(labels, pose.name, &Label::name);
      if (off >= best || like == labels.end()) continue;
      best = off;
      label.finger_class[f] = like->finger_class[f];
    }
  }
  return label;
}

}  // namespace posed::gesture
