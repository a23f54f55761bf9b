// Leads a user from pose to pose: with a bar for each sensor on a terminal, with lines of text
// elsewhere.
#pragma once

#include <chrono>
#include <string>

#include "daemon/tools/devices/calibrate_poses.hpp"
#include "daemon/tools/live/live_view.hpp"

namespace posed::tools {

// On the terminal, which is restored by the destructor.
class PoseScreen final : public PoseGuide {
 public:
  // `note` is shown from the start; may be empty.
  PoseScreen(const drivers::glove::Model& model, const PosePlan& plan, std::string title,
             std::string note);

  void want(drivers::glove::Pose pose) override;
  [[nodiscard]] Word hear() override;
  void show(const GloveSource::Raw& raw, const GloveSource::Valid& valid, PosePhase phase,
            double left_s, double whole_s) override;
  void restless(drivers::glove::Pose pose, const std::string& sensor) override;

 private:
  void draw();

  LiveScreen screen_;
  CalibrateView view_;
  bool ranging_ = false;  // a pose is or was held; from now on the range of each sensor is tracked
  std::chrono::steady_clock::time_point drawn_{}, heard_{};
};

// Prints a line on stdout when a pose is wanted ("pose fist") and instructions on stderr. The user
// confirms with a line on stdin, unless the poses start by themselves.
class PoseLines final : public PoseGuide {
 public:
  explicit PoseLines(const PosePlan& plan) : waits_(!plan.ready_s) {}

  void want(drivers::glove::Pose pose) override;
  [[nodiscard]] Word hear() override;
  void show(const GloveSource::Raw& /*raw*/, const GloveSource::Valid& /*valid*/,
            PosePhase /*phase*/, double /*left_s*/, double /*whole_s*/) override {}
  void restless(drivers::glove::Pose pose, const std::string& sensor) override;

 private:
  bool waits_;
};

}  // namespace posed::tools
