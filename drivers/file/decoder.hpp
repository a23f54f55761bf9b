// Decodes the bytes of a clip into frames, one by one: the motion lines of a BVH, the lines of a
// hand CSV, the blocks of lines of an AMC, or the numbers of any other format
// (proto/clip/device_clip).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/clip/device_clip.hpp"

namespace posed::drivers {

// Device time is the clip's time: frame n, counted over all loops and including unreadable frames,
// is at n / rate. Where frames carry their times, a frame without one comes one step after the
// frame before it, and a time earlier than the times before it begins the next loop.
class ClipDecoder final : public Decoder {
 public:
  explicit ClipDecoder(clip::FrameCoding coding);

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  void feed_numbers(std::span<const std::byte> bytes, Sink& sink) noexcept;
  void end_line(Sink& sink) noexcept;
  void begin_block(std::string_view line, Sink& sink) noexcept;
  void finish_frame(Sink& sink) noexcept;
  void drop_frame(Outcome outcome, Sink& sink) noexcept;
  [[nodiscard]] std::int64_t next_time_ns(double given_s) noexcept;
  [[nodiscard]] std::int64_t next_given_time_ns(double given_s) noexcept;

  clip::FrameCoding coding_;
  std::vector<double> values_;  // [channels]
  std::vector<char> text_;      // of fixed size: the bytes of the frame being collected
  std::size_t size_ = 0;        // of text_ in use
  std::size_t line_begin_ = 0;  // start of the unfinished line in text_
  std::size_t lines_ = 0;       // complete lines in text_
  bool skipping_ = false;       // the unfinished line is too long and already counted
  std::int64_t frames_ = 0;     // so far
  // For frames that carry times:
  std::int64_t last_ns_ = kNoTime_ns;   // time of the frame before
  std::int64_t given_ns_ = kNoTime_ns;  // the last time carried by a frame
  std::int64_t round_ns_ = 0;           // added to the times carried by the frames of this loop
};

}  // namespace posed::drivers
