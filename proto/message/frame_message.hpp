// A frame in the wire format (proto/wire/posed/v1/posed.proto). The message is reused: its packed
// arrays are overwritten in place and never cleared, so encoding a frame allocates nothing.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <span>
#include <string>

#include <google/protobuf/repeated_field.h>

#include "posed/v1/posed.pb.h"
#include "proto/frame/frame.hpp"

namespace posed::message {

// The packed arrays of a message, whose memory is reused.

// Replaces the content of `field` with `values`.
inline void assign(google::protobuf::RepeatedField<float>& field, std::span<const float> values) {
  field.Resize(static_cast<int>(values.size()), 0.0F);
  std::ranges::copy(values, field.begin());
}

// One byte for each flag, 0 or 1.
template <std::size_t N>
void assign_flags(std::string& bytes, const std::bitset<N>& valid, std::size_t count) {
  bytes.resize(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = valid[i] ? 1 : 0;
}

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
