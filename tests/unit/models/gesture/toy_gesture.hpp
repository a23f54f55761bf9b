// A gesture model computed from rules instead of training: the six labels g c p 1 3 4, poses like a
// fist, scissors and an open hand, and smooth delta statistics. Shared by many tests.
#pragma once

#include "models/gesture/gesture_model.hpp"

namespace posed::test {

// Flexion of a finger's joints in each class [rad]: A closed like g, B as in c, C open like p.
inline double toy_flexion(int finger, int joint, int finger_class) {
  const bool points_in_c = finger == 1 || finger == 2;  // c: index and middle straight, rest closed
  const double closed = finger == 0 ? 0.6 : 1.3 - 0.1 * joint;
  if (finger_class == 0) return closed;
  if (finger_class == 1) return points_in_c ? 0.15 : closed - 0.1;
  return 0.05 + 0.01 * finger;
}

// A tree of three leaves that asks for the current label's class only: A, B, else C.
inline gesture::Tree<gesture::GroupGaussian> toy_tree(int state, int finger) {
  using namespace gesture;
  Tree<GroupGaussian> tree;
  tree.nodes = {{kClasses + 0, 1, 2, -1},
                {-1, -1, -1, 0},
                {kClasses + 1, 3, 4, -1},
                {-1, -1, -1, 1},
                {-1, -1, -1, 2}};
  tree.leaves.resize(3);
  tree.occupancy.assign(3, 100.0);
  const double loose =
      state == 0 || state == 4 ? 9.0 : 1.0;  // the hand moves in the first and last state
  for (int leaf = 0; leaf < 3; ++leaf) {
    GroupGaussian& gaussian = tree.leaves[leaf];
    gaussian.mean.fill(std::vector<double>(kFingerChannels));
    gaussian.variance.fill(std::vector<double>(kFingerChannels));
    for (int c = 0; c < kFingerChannels; ++c) {
      const bool moves = c % 3 == 0;
      gaussian.mean[0][c] = moves ? toy_flexion(finger, c / 3, leaf) : 0.0;
      gaussian.variance[0][c] = moves ? loose * 3e-4 : 1e-5;
      gaussian.variance[1][c] = moves ? loose * 2e-5 : 1e-6;
      gaussian.variance[2][c] = moves ? loose * 1e-5 : 1e-6;
    }
  }
  return tree;
}

inline gesture::GestureModel toy_gesture_model() {
  using namespace gesture;
  GestureModel model;
  // The built-in classes, thumb to little (models/gesture/README.md, "Questions and unseen
  // labels").
  model.labels = {{"g", {0, 0, 0, 0, 0}, true},  {"c", {1, 1, 1, 1, 1}, true},
                  {"p", {2, 2, 2, 2, 2}, true},  {"1", {0, 2, 0, 0, 0}, false},
                  {"3", {0, 2, 2, 2, 0}, false}, {"4", {0, 2, 2, 2, 2}, false}};
  for (int state = 0; state < kStates; ++state) {
    for (int finger = 0; finger < kFingers; ++finger) {
      model.trees[state].push_back(toy_tree(state, finger));
    }
  }
  // One question: scissors (c) last a little longer.
  model.durations.nodes = {{kClasses + 1, 1, 2, -1}, {-1, -1, -1, 0}, {-1, -1, -1, 1}};
  model.durations.leaves = {{{11.2, 14.0, 15.6, 12.4, 8.0}, {4.0, 9.0, 12.0, 9.0, 6.0}},
                            {{10.1, 12.3, 14.8, 11.6, 7.2}, {4.0, 8.0, 10.0, 8.0, 5.0}}};
  model.durations.occupancy = {33.0, 67.0};
  for (int c = 0; c < kHandChannels; ++c) {
    const bool moves = c % 3 == 0;
    model.low.push_back(moves ? -0.1 : 0.0);
    model.high.push_back(moves ? 1.6 : 0.0);
  }
  model.report_json = "{}";
  return model;
}

}  // namespace posed::test
