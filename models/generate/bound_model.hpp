// BoundModel: a gesture model prepared for one stream: its state information at the stream's rate,
// and the live smoother's model (models/generate/README.md, "Binding a model"). Built cold, then
// const; the hot side borrows a plain pointer.
#pragma once

#include <algorithm>
#include <memory>
#include <string>

#include "models/gesture/gesture_model.hpp"
#include "models/smooth/live_model.hpp"
#include "models/stage.hpp"
#include "models/trajectory/state_information.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::generate {

inline constexpr int kMaxWaiting = 1024;  // most labels of one stream that wait to be performed

struct BoundModel final : StageModel {
  BoundModel(trajectory::StateInformation states, std::unique_ptr<const smooth::LiveModel> smoother,
             std::string file);

  trajectory::StateInformation information;  // holds the gesture model
  std::unique_ptr<const smooth::LiveModel> live;

  [[nodiscard]] const gesture::GestureModel& gesture() const noexcept {
    return information.model();
  }
};

// The assumed rate of a stream [Hz] that states `nominal_hz` (0: unknown).
[[nodiscard]] constexpr double stream_rate_hz(double nominal_hz) noexcept {
  return nominal_hz > 0.0 ? std::clamp(nominal_hz, 10.0, 1000.0) : 60.0;
}

// Returns an error for a skeleton that lacks channels of the model. `rate_hz` is the stream's, 0 if
// unknown. Cold.
Result<std::unique_ptr<const BoundModel>> bind_model(gesture::GestureModel model,
                                                     const Skeleton& skeleton, double rate_hz,
                                                     std::string name);

}  // namespace posed::generate
