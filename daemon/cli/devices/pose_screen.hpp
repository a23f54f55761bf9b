// Who leads a user from pose to pose: a screen with a bar for each sensor, or lines of text where
// there is no terminal.
#pragma once

#include <chrono>
#include <string>

#include "daemon/cli/devices/calibrate_poses.hpp"
#include "daemon/cli/live/live_view.hpp"

namespace posed::cli {

// On the terminal, which is as it was once this is gone.
class PoseScreen final : public PoseGuide {
 public:
  // `note` stands on the screen from the start; may be empty.
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
  bool ranging_ = false;  // a pose is, or was, held: where sensors have been counts from then on
  std::chrono::steady_clock::time_point drawn_{}, heard_{};
};

// A line on stdout when a pose is wanted ("pose fist"), what to do on stderr, and a line on stdin
// for "I hold it", unless the poses begin by themselves.
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

}  // namespace posed::cli
