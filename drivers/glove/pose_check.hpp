// Checks whether the poses of a calibration were held well enough: the hand was still in each pose,
// its sensors moved between them, by about as much as the glove's do, and poses that share straight
// or bent fingers agree. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// One recorded pose, and the sensors whose calibration uses it.
struct PoseFinding {
  Pose pose = Pose::kFlat;
  int sensors = 0;
  std::vector<std::string> moved;       // sensors that moved while the pose was held
  std::vector<std::string> stuck;       // sensors whose value hardly differs from the flat hand
  std::vector<std::string> restless{};  // sensors that moved, also if the pose is good all the same
  std::string wrong{};                  // what other hand was held; empty: none that is known
  double unrest = 0.0;  // median over the sensors: standard deviation as a share of their span

  // True when too many of its sensors moved, or did not reach the pose: hold it again.
  [[nodiscard]] bool failed() const;
  [[nodiscard]] std::string sentence() const;  // "thumb failed: ... : hold it again"
};

struct PoseCheck {
  std::vector<PoseFinding> poses;  // the recorded ones, in their order
  int sensors = 0;                 // number of sensors that any pose moves
  // What is odd although no pose failed, each a part of the verdict's sentence.
  std::vector<std::string> doubts{};

  [[nodiscard]] std::vector<Pose> failed() const;
  [[nodiscard]] bool usable() const { return failed().empty(); }
  // One sentence: the poses that failed and why, or how good the calibration is.
  [[nodiscard]] std::string verdict() const;
};

// Fails when the device's map cannot be read.
Result<PoseCheck> check_poses(const Model& model, const Recorded& recorded);

}  // namespace posed::drivers::glove
