// FrameOutput: another way out of the daemon, beside ZeroMQ. The publisher's thread hands it the
// final frames of the streams that it wants. It only takes them: it sends on a thread of its own,
// so that whoever receives them cannot hold up the publisher.
#pragma once

#include <cstdint>
#include <string_view>

#include "proto/frame/frame.hpp"

namespace posed::v1 {
class OutputStats;
}

namespace posed::publish {

struct StreamInfo;

class FrameOutput {
 public:
  FrameOutput() = default;
  FrameOutput(const FrameOutput&) = delete;
  FrameOutput& operator=(const FrameOutput&) = delete;
  virtual ~FrameOutput() = default;

  // Whether it wants the stream of this name, always with the same answer.
  [[nodiscard]] virtual bool wants(std::string_view stream) const noexcept = 0;

  // The publisher's thread. None of them waits for anything but another thread's few instructions.
  // A wanted stream has come, or returns with another id and skeleton; called before its first
  // frame.
  virtual void stream_comes(const StreamInfo& stream) = 0;
  // Of a stream that has come (Header::stream). Stale frames come, too.
  virtual void frame(const Frame& frame) noexcept = 0;
  virtual void sample(const Sample& sample) noexcept = 0;
  virtual void stream_leaves(std::uint32_t stream) noexcept = 0;

  // Any thread.
  virtual void fill(v1::OutputStats& stats) const = 0;
};

}  // namespace posed::publish
