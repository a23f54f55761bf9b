// RetargetStage: the stream's last stage, which puts its pose on another skeleton
// (motion/retarget.hpp). One thread.
#pragma once

#include <utility>

#include "models/motion/retarget.hpp"
#include "models/stage.hpp"

namespace posed::retarget {

class RetargetStage final : public Stage {
 public:
  explicit RetargetStage(motion::Retarget retarget) : retarget_(std::move(retarget)) {}

  // The variance of the pose is not carried over: it belongs to the source's channels. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override {
    retarget_.apply(in.frame, frame_);
    out.frame({.frame = frame_, .variance_rad2 = {}, .input = in.input});
  }

 private:
  motion::Retarget retarget_;
  Frame frame_;  // the last one: the next one's angles stay near to it
};

}  // namespace posed::retarget
