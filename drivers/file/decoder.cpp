#include "drivers/file/decoder.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <limits>

#include "proto/clip/text.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {
namespace {

// A word that is a number but not a plausible one (nan, inf, 1e300) counts as out of range; any
// other word as foreign.
RT_SAFE Outcome outcome_of(const clip::FrameOutcome& parsed) noexcept {
  switch (parsed.fault) {
    case clip::FrameFault::kNone:
      return Outcome::kOk;
    case clip::FrameFault::kTooFew:
    case clip::FrameFault::kMissingBone:
      return Outcome::kShort;
    case clip::FrameFault::kImplausible:
      return Outcome::kOutOfRange;
    case clip::FrameFault::kNoTime:
    case clip::FrameFault::kNotANumber: {
      double value = 0.0;
      const char* const begin = parsed.where.data();
      const char* const end = begin + parsed.where.size();
      return std::from_chars(begin, end, value).ptr == end ? Outcome::kOutOfRange
                                                           : Outcome::kForeign;
    }
    default:
      return Outcome::kForeign;
  }
}

RT_SAFE bool is_frame_number(std::string_view line) noexcept {
  return std::ranges::all_of(line, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

ClipDecoder::ClipDecoder(clip::FrameCoding coding)
    : coding_(std::move(coding)), values_(coding_.parser.channels()), text_(kMaxChunk) {
  assert(coding_.parser.frame_bytes() <= text_.size());
}

RT_SAFE void ClipDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                               Sink& sink) noexcept {
  if (coding_.parser.frame_bytes() > 0) {
    feed_numbers(bytes, sink);
    return;
  }
  for (const std::byte byte : bytes) {
    const char c = static_cast<char>(byte);
    if (c == '\n' || c == '\r') {
      end_line(sink);
    } else if (size_ + 1 < text_.size()) {
      text_[size_++] = c;  // the last byte is reserved for the line end
    } else if (!skipping_) {
      skipping_ = true;
      drop_frame(Outcome::kForeign, sink);
    }
  }
}

// Frames of numbers have no mark between them; all have the same length.
RT_SAFE void ClipDecoder::feed_numbers(std::span<const std::byte> bytes, Sink& sink) noexcept {
  for (const std::byte byte : bytes) {
    text_[size_++] = static_cast<char>(byte);
    if (size_ == coding_.parser.frame_bytes()) finish_frame(sink);
  }
}

RT_SAFE void ClipDecoder::end_line(Sink& sink) noexcept {
  const std::string_view line = clip::trim({text_.data() + line_begin_, size_ - line_begin_});
  if (skipping_ || line.empty() || line.front() == '#') {
    skipping_ = false;
    size_ = line_begin_;
    return;
  }
  text_[size_++] = '\n';
  if (!coding_.parser.numbered()) {
    finish_frame(sink);
    return;
  }
  if (is_frame_number(line)) {
    begin_block(line, sink);
    return;
  }
  if (lines_ == 0) {  // between two blocks
    sink.outcome(Outcome::kForeign);
    size_ = 0;
    return;
  }
  line_begin_ = size_;
  // A block has no end mark. It is complete once every bone is present, so that a frame need not
  // wait for the start of the next.
  if (++lines_ >= coding_.parser.lines()) finish_frame(sink);
}

RT_SAFE void ClipDecoder::begin_block(std::string_view line, Sink& sink) noexcept {
  const char* const begin = line.data();
  const std::size_t length = line.size();
  if (lines_ > 0) drop_frame(Outcome::kShort, sink);
  std::copy(begin, begin + length, text_.begin());
  text_[length] = '\n';
  size_ = line_begin_ = length + 1;
  lines_ = 1;
}

RT_SAFE void ClipDecoder::finish_frame(Sink& sink) noexcept {
  const clip::FrameOutcome parsed = coding_.parser.parse({text_.data(), size_}, values_);
  const Outcome outcome = outcome_of(parsed);
  // A bone may span two lines; the limit keeps garbage from being collected without end.
  if (outcome == Outcome::kShort && lines_ > 0 && lines_ < 2 * coding_.parser.lines()) return;
  if (outcome != Outcome::kOk) {
    drop_frame(outcome, sink);
    return;
  }
  Frame frame;
  frame.header.device_ns = next_time_ns(parsed.time_s);
  frame.source = Source::kFile;
  frame.timecode = parsed.timecode;
  pose_from_channels(*coding_.skeleton, values_, frame);
  size_ = line_begin_ = lines_ = 0;
  sink.outcome(Outcome::kOk);
  sink.frame(frame);
}

RT_SAFE void ClipDecoder::drop_frame(Outcome outcome, Sink& sink) noexcept {
  size_ = line_begin_ = lines_ = 0;
  (void)next_time_ns(std::numeric_limits<double>::quiet_NaN());
  sink.outcome(outcome);
}

RT_SAFE std::int64_t ClipDecoder::next_time_ns(double given_s) noexcept {
  if (coding_.parser.timed()) return next_given_time_ns(given_s);
  return nanoseconds(static_cast<double>(frames_++) / coding_.frame_rate_hz);
}

RT_SAFE std::int64_t ClipDecoder::next_given_time_ns(double given_s) noexcept {
  const std::int64_t step_ns = std::max<std::int64_t>(1, nanoseconds(1 / coding_.frame_rate_hz));
  const bool is_first = last_ns_ == kNoTime_ns;
  const std::int64_t following_ns = is_first ? 0 : last_ns_ + step_ns;
  if (std::isnan(given_s)) {
    last_ns_ = following_ns;
    return last_ns_;
  }
  const std::int64_t time_ns = nanoseconds(given_s);
  if (given_ns_ != kNoTime_ns && time_ns < given_ns_) round_ns_ = following_ns - time_ns;
  const bool repeats = given_ns_ != kNoTime_ns && time_ns == given_ns_;
  given_ns_ = time_ns;
  const std::int64_t proper_ns = repeats ? following_ns : round_ns_ + time_ns;
  // An earlier frame without a time may have been placed later than this one really is.
  last_ns_ = is_first ? proper_ns : std::max(proper_ns, last_ns_ + 1);
  return last_ns_;
}

}  // namespace posed::drivers
