// Who wants to see frames beside those who subscribe to them: RawTap those before all stages,
// FrameTap those that leave the stages.
#pragma once

#include <cstdint>

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

class FrameTap {
 public:
  FrameTap() = default;
  FrameTap(const FrameTap&) = delete;
  FrameTap& operator=(const FrameTap&) = delete;
  virtual ~FrameTap() = default;

  // Pipeline thread, of every stream, in order, also those that are repeated or for which the
  // publisher has no room. `item`: the number of the item that was handled then, or last. Copies
  // at most, and never waits.
  RT_SAFE virtual void frame(const Frame& frame, std::uint64_t item) noexcept = 0;
};

}  // namespace posed::pipeline
