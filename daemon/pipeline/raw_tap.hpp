// RawTap: who wants to see the frames before all stages, beside those who subscribe to them.
#pragma once

#include "proto/frame/frame.hpp"

namespace posed::pipeline {

class RawTap {
 public:
  RawTap() = default;
  RawTap(const RawTap&) = delete;
  RawTap& operator=(const RawTap&) = delete;
  virtual ~RawTap() = default;

  // Publisher thread, of every stream with publish_raw, in order. Copies at most, and never waits.
  RT_SAFE virtual void raw_frame(const Frame& frame) noexcept = 0;
};

}  // namespace posed::pipeline
