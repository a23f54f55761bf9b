// A clip's text to frames, one by one: the lines of a BVH's motion or of a hand CSV, an AMC's
// blocks of lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"
#include "proto/clip/text_clip.hpp"

namespace posed::drivers {

// Device time is the clip's: frame n, counted over all loops and with the frames that could not be
// read, is at n / rate. A hand CSV's frames bring their times: one without comes a step after the
// frame before, one that lies before the times already given begins the next round.
class ClipDecoder final : public Decoder {
 public:
  explicit ClipDecoder(clip::ClipFormat format);

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 private:
  void end_line(Sink& sink) noexcept;
  void begin_block(std::string_view line, Sink& sink) noexcept;
  void finish_frame(Sink& sink) noexcept;
  void drop_frame(Outcome outcome, Sink& sink) noexcept;
  [[nodiscard]] std::int64_t next_time_ns(double given_s) noexcept;
  [[nodiscard]] std::int64_t next_given_time_ns(double given_s) noexcept;

  clip::ClipFormat format_;
  std::vector<double> values_;  // [channels]
  std::vector<char> text_;      // of fixed size: the frame being collected, line by line
  std::size_t size_ = 0;        // of text_ in use
  std::size_t line_begin_ = 0;  // of the open line in text_
  std::size_t lines_ = 0;       // complete ones in text_
  bool skipping_ = false;       // the open line is too long and already counted
  std::int64_t frames_ = 0;     // so far
  // Of frames that bring their times:
  std::int64_t last_ns_ = kNoTime_ns;   // time of the frame before
  std::int64_t given_ns_ = kNoTime_ns;  // the last time that a frame brought
  std::int64_t round_ns_ = 0;           // added to what the frames of this round bring
};

}  // namespace posed::drivers
