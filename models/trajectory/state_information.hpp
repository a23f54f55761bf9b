// StateInformation: the Gaussians of each state of a gesture model, as rows of an InformationForm
// at one frame rate, and the state's duration in frames. Built cold, then const and shared between
// threads.
//
// At a rate r times the model's, means are divided by r (delta) and r^2 (delta-delta), variances
// multiplied by r (position) and divided by r (delta) and r^3 (delta-delta), durations multiplied
// by r (models/trajectory/README.md, "State information and frame rate").
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/trajectory/information_form.hpp"

namespace posed::trajectory {

class StateInformation {
 public:
  StateInformation(std::shared_ptr<const gesture::GestureModel> model, double rate_hz);

  // Writes the kRows rows (stride padded(channels of the model)) of one frame in `state` (from 0)
  // of a gesture.
  RT_SAFE void fill(const gesture::Context& context, int state, double* rows) const noexcept;

  // Durations in frames of rate_hz().
  RT_SAFE [[nodiscard]] gesture::DurationGaussian duration(
      const gesture::Context& context) const noexcept;

  [[nodiscard]] const gesture::GestureModel& model() const noexcept { return *model_; }
  [[nodiscard]] double rate_hz() const noexcept { return rate_hz_; }

 private:
  using GroupRows = std::array<std::vector<double>, kRows>;  // [row][channel of the group]

  std::shared_ptr<const gesture::GestureModel> model_;
  double rate_hz_;
  // [state][group][leaf]
  std::array<std::vector<std::vector<GroupRows>>, gesture::kStates> leaves_;
};

}  // namespace posed::trajectory
