// A frame in the wire format (proto/wire/posed/v1/posed.proto). The message is reused: its packed
// arrays are overwritten in place and never cleared, so encoding a frame allocates nothing.
#pragma once

#include <span>
#include <string>

#include "posed/v1/posed.pb.h"
#include "proto/frame/frame.hpp"

namespace posed::message {

// The frame message of one published stream. One thread; RT-safe after the first frame.
class FrameEncoder {
 public:
  explicit FrameEncoder(const std::string& stream) { message_.set_stream(stream); }

  // The frame without stage stamps, as logs store it; valid until the next call.
  [[nodiscard]] const v1::Frame& encode(const Frame& frame);
  // Adds the stage stamps that are known to the message that encode() made.
  [[nodiscard]] const v1::Frame& stamp(const StageStamps& stamps, std::span<const float> stage_us);

 private:
  v1::Frame message_;
};

}  // namespace posed::message
