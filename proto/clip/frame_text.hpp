// FrameParser: one frame's text, as it stands in a clip, to channel values, NaN where a hand CSV's
// field is empty. The readers and the
// file driver's decoder share it, so a recorded log decodes exactly as the clip does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/acclaim.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::clip {

enum class FrameFault : std::uint8_t {
  kNone,
  kNotANumber,    // a word that is no finite number
  kImplausible,   // a number beyond what a pose can have (proto/frame/plausible.hpp)
  kTooFew,        // values missing
  kTooMany,       // values left over
  kUnknownBone,   // AMC: a name the skeleton does not have
  kRepeatedBone,  // AMC
  kMissingBone,   // AMC: a bone with channels does not appear
  kNoNumber       // AMC: the block does not begin with a frame number
};

struct FrameOutcome {
  FrameFault fault = FrameFault::kNone;
  std::string_view where;    // the word or bone to add_error; into the text or the parser
  std::size_t offset = 0;    // of the fault in the text
  std::size_t expected = 0;  // values wanted and found, for too few and too many
  std::size_t found = 0;
  std::int64_t number = 0;                                   // AMC: the frame's number
  double time_s = std::numeric_limits<double>::quiet_NaN();  // hand CSV, where it is given

  [[nodiscard]] bool ok() const noexcept { return fault == FrameFault::kNone; }
  // One sentence for people. Cold.
  [[nodiscard]] std::string sentence() const;
};

class FrameParser {
 public:
  // A BVH motion line: the values of all channels, in order, degrees and file units.
  [[nodiscard]] static FrameParser bvh(const Skeleton& skeleton, double metres_per_unit);

  // An AMC block: the frame's number, then a bone's name and its values for each bone.
  [[nodiscard]] static FrameParser amc(const Acclaim& acclaim, bool degrees);

  // A line of a hand CSV: the time and 45 angles in hand45 order, in radians; an empty field is a
  // missing value.
  [[nodiscard]] static FrameParser hand_csv();

  // Values parse() writes: the skeleton's channels.
  [[nodiscard]] std::size_t channels() const noexcept { return scale_.size(); }

  // Frames carry a number of their own (AMC).
  [[nodiscard]] bool numbered() const noexcept { return !bones_.empty(); }

  // Frames may carry a time of their own (hand CSV).
  [[nodiscard]] bool timed() const noexcept { return timed_; }

  // Lines that a frame's text has at least: one; for an AMC its number and a line for each bone
  // with channels.
  [[nodiscard]] std::size_t lines() const noexcept { return lines_; }

  // `text` to `values` [channels(), rad and m]; they are unspecified unless the outcome is ok.
  // White space and line ends do not matter. RT-safe.
  [[nodiscard]] FrameOutcome parse(std::string_view text, std::span<double> values) const noexcept;

 private:
  FrameOutcome parse_line(std::string_view text, std::span<double> values) const noexcept;
  FrameOutcome parse_block(std::string_view text, std::span<double> values) const noexcept;
  FrameOutcome parse_fields(std::string_view text, std::span<double> values) const noexcept;
  [[nodiscard]] int find_bone(std::string_view name) const noexcept;

  // Scales and keeps one value; false when no pose can have it. RT-safe.
  [[nodiscard]] bool keep(double value, std::size_t channel,
                          std::span<double> values) const noexcept;

  std::vector<double> scale_;       // [channel], file value to rad or m
  std::vector<double> limit_;       // [channel], rad or m: no value is larger
  std::vector<AcclaimBone> bones_;  // sorted by name; empty for a BVH
  std::size_t lines_ = 1;
  bool timed_ = false;
};

}  // namespace posed::clip
