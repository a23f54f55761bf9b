// An Emit that keeps the last frame and counts all frames.
#pragma once

#include "proto/frame/sink.hpp"

namespace posed::test {

class LastFrame final : public Emit {
 public:
  void frame(const Frame& frame) noexcept override {
    out = frame;
    ++count;
  }
  Frame out;
  int count = 0;
};

}  // namespace posed::test
