// The part of `posed calibrate` that records pose after pose. A PoseGuide leads the user through
// it: a screen (pose_screen.hpp), lines of text for scripts, or a test.
#pragma once

#include <array>
#include <optional>

#include "daemon/tools/devices/calibrate_view.hpp"
#include "daemon/tools/devices/glove_source.hpp"
#include "drivers/glove/fit.hpp"

namespace posed::tools {

struct PosePlan {
  // How long each pose is recorded [s]; 0: skip it. The flat hand is never skipped.
  std::array<double, drivers::glove::kPoses> seconds{2.0, 2.0, 2.0, 2.0};
  // How long the user has to take a pose that starts by itself [s]; empty: the guide starts it.
  std::optional<double> ready_s{};
  double settle_s = 0.5;  // not recorded, so that the hand and the glove's filter come to rest

  [[nodiscard]] std::vector<drivers::glove::Pose> poses() const;
};

class PoseGuide {
 public:
  PoseGuide() = default;
  PoseGuide(const PoseGuide&) = delete;
  PoseGuide& operator=(const PoseGuide&) = delete;
  virtual ~PoseGuide() = default;

  virtual void want(drivers::glove::Pose pose) = 0;

  // The user's reply while a pose is asked for. The call must not wait; it is made at least ten
  // times a second.
  enum class Word { kNothing, kGo, kBack, kStop };
  [[nodiscard]] virtual Word hear() = 0;

  // One measurement. `left_s` of `whole_s` remain: of the time to get ready, or of the time to hold
  // still, settling included. Both are 0 if the user ends the phase.
  virtual void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
                    double left_s, double whole_s) = 0;

  // The hand moved while the pose was held; `sensor` shows it.
  virtual void restless(drivers::glove::Pose pose, const std::string& sensor) = 0;
};

// An error if the user gives up, the glove is unplugged, or it sends nothing.
[[nodiscard]] Result<drivers::glove::Recorded> record_poses(GloveSource& source,
                                                            const PosePlan& plan, PoseGuide& guide);

}  // namespace posed::tools
