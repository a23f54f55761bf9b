// Whether the poses of a calibration were held well enough to rest on: the hand was still in each,
// and its sensors moved between them. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// One pose that was recorded, and the sensors whose calibration rests on it.
struct PoseFinding {
  Pose pose = Pose::kFlat;
  int sensors = 0;
  std::vector<std::string> moved;  // while the pose was held
  std::vector<std::string> stuck;  // hardly another value than with the flat hand
  double unrest = 0.0;  // median over the sensors: standard deviation as a share of their way

  // Too many of its sensors moved, or did not get there: hold it again.
  [[nodiscard]] bool failed() const;
  [[nodiscard]] std::string sentence() const;  // "thumb failed: ... : hold it again"
};

struct PoseCheck {
  std::vector<PoseFinding> poses;  // recorded ones, in their order
  int sensors = 0;                 // that any pose moves

  [[nodiscard]] std::vector<Pose> failed() const;
  [[nodiscard]] bool usable() const { return failed().empty(); }
  // One sentence: which poses failed and why, or how good the calibration is.
  [[nodiscard]] std::string verdict() const;
};

// An error when the device's map cannot be read.
[[nodiscard]] Result<PoseCheck> check_poses(const Model& model, const Recorded& recorded);

}  // namespace posed::drivers::glove
