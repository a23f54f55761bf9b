// A StageOut that keeps the last frame and counts them all.
#pragma once

#include "models/stage.hpp"

namespace posed::test {

class LastFrame final : public StageOut {
 public:
  void frame(const StageFrame& made) noexcept override {
    const Frame& frame = made.frame;
    out = frame;
    ++count;
  }
  Frame out;
  int count = 0;
};

}  // namespace posed::test
