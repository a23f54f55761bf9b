// FrameParser: turns the bytes of one frame of a clip, its text or its numbers, into channel
// values, NaN where one is missing. The readers of text formats and the decoder of the file driver
// share it, so a recorded log decodes exactly as the clip does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/acclaim.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/frame/timecode.hpp"

namespace posed::clip {

enum class FrameFault : std::uint8_t {
  kNone,
  kNotANumber,    // a word that is not a finite number
  kImplausible,   // a number outside the plausible range (proto/frame/plausible.hpp)
  kNoTime,        // a time that is no number of seconds
  kTooFew,        // values missing
  kTooMany,       // values left over
  kUnknownBone,   // AMC: a name the skeleton does not have
  kRepeatedBone,  // AMC
  kMissingBone,   // AMC: a bone with channels does not appear
  kNoNumber       // AMC: the block does not begin with a frame number
};

struct FrameOutcome {
  FrameFault fault = FrameFault::kNone;
  std::string_view where;    // the word or bone at fault; points into the text or the parser
  std::size_t offset = 0;    // byte offset of the fault in the text
  std::size_t expected = 0;  // for too few and too many: values expected and found
  std::size_t found = 0;
  std::int64_t number = 0;                                   // AMC: the frame's own number
  double time_s = std::numeric_limits<double>::quiet_NaN();  // the frame's own time, if given
  Timecode timecode{};                                       // empty where the frame has none

  [[nodiscard]] bool ok() const noexcept { return fault == FrameFault::kNone; }
  // Describes the outcome in one sentence. Cold.
  [[nodiscard]] std::string sentence() const;
};

class FrameParser {
 public:
  // Parses a BVH motion line: the values of all channels in order, in degrees and file units.
  // `factors` [channel of the file]: -1 where its axis is turned round, 0 where its joint was left
  // out (clip/figure.hpp), else 1; empty for a skeleton as it stands in the file.
  [[nodiscard]] static FrameParser bvh(const Skeleton& skeleton, double metres_per_unit,
                                       std::span<const double> factors = {});

  // Parses an AMC block: the frame's number, then for each bone its name and its values.
  [[nodiscard]] static FrameParser amc(const Acclaim& acclaim, bool degrees);

  // Parses a line of a hand CSV: the time and 45 angles in hand45 order, in radians. An empty field
  // is a missing value.
  [[nodiscard]] static FrameParser hand_csv();

  // Copies a frame of frame_bytes(): the values of all channels, in radians and metres. They stand
  // behind the frame's time, where frames have one, and its timecode, the same.
  [[nodiscard]] static FrameParser numbers(const Skeleton& skeleton, bool timed, bool timecoded);

  // Length of a frame in bytes; 0 for a text, whose frames end with their line.
  [[nodiscard]] std::size_t frame_bytes() const noexcept {
    return is_text_ ? 0
                    : sizeof(double) * (channels() + (timed_ ? 1 : 0)) +
                          (timecoded_ ? sizeof(Timecode) : 0);
  }

  // Number of values that parse() writes: the skeleton's channels.
  [[nodiscard]] std::size_t channels() const noexcept { return scale_.size(); }

  // True when frames carry a number of their own (AMC).
  [[nodiscard]] bool numbered() const noexcept { return !bones_.empty(); }

  // True when frames may carry a time of their own.
  [[nodiscard]] bool timed() const noexcept { return timed_; }

  // The least number of lines in a frame's text: one; for an AMC one for the frame number and one
  // for each bone with channels.
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

  // Parses `text` into `values` [channels(), rad and m]. They are unspecified unless the outcome is
  // ok. In a text, white space and line ends do not matter.
  RT_SAFE [[nodiscard]] FrameOutcome parse(std::string_view text,
                                           std::span<double> values) const noexcept;

 private:
  FrameOutcome parse_line(std::string_view text, std::span<double> values) const noexcept;
  FrameOutcome parse_block(std::string_view text, std::span<double> values) const noexcept;
  FrameOutcome parse_fields(std::string_view text, std::span<double> values) const noexcept;
  FrameOutcome parse_numbers(std::string_view bytes, std::span<double> values) const noexcept;
  [[nodiscard]] int find_bone(std::string_view name) const noexcept;

  // Scales and stores one value; returns false when it is not plausible.
  RT_SAFE [[nodiscard]] bool keep(double value, std::size_t channel,
                                  std::span<double> values) const noexcept;

  std::vector<double> scale_;       // [channel], factor from file value to rad or m
  std::vector<char> left_out_;      // [channel of the file]; empty: none is
  std::vector<double> limit_;       // [channel], largest allowed size of a value, rad or m
  std::vector<AcclaimBone> bones_;  // AMC, sorted by name
  std::size_t lines_ = 1;
  bool timed_ = false;
  bool timecoded_ = false;
  bool is_text_ = true;
};

// The bytes of a frame that FrameParser::numbers() reads: little-endian doubles, and the text of a
// timecode. `time_s` and `timecode` are left out where they are empty. Cold.
[[nodiscard]] std::string frame_bytes(std::optional<double> time_s,
                                      const std::optional<Timecode>& timecode,
                                      std::span<const double> values);

}  // namespace posed::clip
