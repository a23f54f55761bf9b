// The part of `posed calibrate` in which a hand goes from pose to pose.
#pragma once

#include <array>
#include <functional>

#include "daemon/cli/glove_source.hpp"
#include "drivers/glove/fit.hpp"

namespace posed::cli {

struct PosePlan {
  // How long each pose is recorded [s]; 0 leaves it out. The flat hand is never left out.
  std::array<double, drivers::glove::kPoses> seconds{2.0, 2.0, 2.0, 2.0};
  double settle_s = 0.5;  // not recorded: the hand comes to rest, the glove's filter, too
};

// Called before each pose; false ends the calibration (the user gave up).
using AskForPose = std::function<bool(drivers::glove::Pose)>;
// Called for each measurement while a pose is held: a live view.
using ShowSensors =
    std::function<void(const GloveSource::Raw& raw, const GloveSource::Valid& valid)>;

[[nodiscard]] Result<drivers::glove::Recorded> record_poses(GloveSource& source,
                                                            const PosePlan& plan,
                                                            const AskForPose& ask,
                                                            const ShowSensors& show);

// A bar for each sensor on a terminal, redrawn in place; nothing elsewhere.
class SensorBars {
 public:
  explicit SensorBars(const drivers::glove::Model& model);
  void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid);
  void end();  // the next show() draws below

 private:
  const drivers::glove::Model& model_;
  bool terminal_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace posed::cli
