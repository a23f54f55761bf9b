// The part of `posed calibrate` in which a hand goes from pose to pose. Who leads the user through
// it is a PoseGuide: a screen (pose_screen.hpp), lines for scripts, or a test.
#pragma once

#include <array>
#include <optional>

#include "daemon/cli/devices/calibrate_view.hpp"
#include "daemon/cli/devices/glove_source.hpp"
#include "drivers/glove/fit.hpp"

namespace posed::cli {

struct PosePlan {
  // How long each pose is recorded [s]; 0 leaves it out. The flat hand is never left out.
  std::array<double, drivers::glove::kPoses> seconds{2.0, 2.0, 2.0, 2.0};
  // How long the user has to take a pose that begins by itself [s]; none: the guide says when.
  std::optional<double> ready_s{};
  double settle_s = 0.5;  // not recorded: the hand comes to rest, the glove's filter, too

  [[nodiscard]] std::vector<drivers::glove::Pose> poses() const;
};

class PoseGuide {
 public:
  PoseGuide() = default;
  PoseGuide(const PoseGuide&) = delete;
  PoseGuide& operator=(const PoseGuide&) = delete;
  virtual ~PoseGuide() = default;

  virtual void want(drivers::glove::Pose pose) = 0;

  // What the user says while a pose is asked for; never waits, called ten times a second at least.
  enum class Word { kNothing, kGo, kBack, kStop };
  [[nodiscard]] virtual Word hear() = 0;

  // A measurement. `left_s` of `whole_s` are still to come: of the time to get ready, or to be
  // still, settling included; both 0 where the user ends it.
  virtual void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
                    double left_s, double whole_s) = 0;

  // The hand was not still while the pose was held; this sensor tells.
  virtual void restless(drivers::glove::Pose pose, const std::string& sensor) = 0;
};

// An error when the user gives up, the glove goes, or nothing comes from it.
[[nodiscard]] Result<drivers::glove::Recorded> record_poses(GloveSource& source,
                                                            const PosePlan& plan, PoseGuide& guide);

}  // namespace posed::cli
