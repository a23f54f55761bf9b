#include "proto/clip/frame_text.hpp"

#include <numbers>

#include "proto/clip/text.hpp"

namespace posed::clip {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::string counted(std::size_t count, std::string_view what) {
  return std::to_string(count) + " " + std::string(what) + (count == 1 ? "" : "s");
}

}  // namespace

std::string FrameOutcome::sentence() const {
  switch (fault) {
    case FrameFault::kNone:
      return "the frame is good";
    case FrameFault::kNotANumber:
      return in_quotes(where) + " is not a number a pose can have";
    case FrameFault::kTooFew:
    case FrameFault::kTooMany:
      return (where.empty() ? std::string("the frame") : in_quotes(where)) + " has " +
             counted(found, "value") + (fault == FrameFault::kTooMany ? " or more" : "") +
             ", but its channels need " + std::to_string(expected) +
             "; the file is damaged or cut off here";
    case FrameFault::kUnknownBone:
      return "the skeleton has no bone " + in_quotes(where) +
             " with channels; is this the right skeleton for the clip?";
    case FrameFault::kRepeatedBone:
      return "bone " + in_quotes(where) + " appears twice in this frame";
    case FrameFault::kMissingBone:
      return "bone " + in_quotes(where) +
             " is missing from this frame; the file is damaged or cut off";
    case FrameFault::kNoNumber:
      return in_quotes(where) + " stands where a frame number should";
  }
  return {};
}

FrameParser FrameParser::bvh(const Skeleton& skeleton, double metres_per_unit) {
  FrameParser parser;
  for (const Channel& channel : skeleton.channels) {
    parser.scale_.push_back(channel.translation ? metres_per_unit : kDegree);
  }
  return parser;
}

FrameOutcome FrameParser::parse(std::string_view text, std::span<double> values) const noexcept {
  FrameOutcome outcome;
  outcome.expected = scale_.size();
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    if (outcome.found == scale_.size() || outcome.found == values.size()) {
      outcome.fault = FrameFault::kTooMany;
      ++outcome.found;
      return outcome;
    }
    const auto value = parse_number(word);
    if (!value) {
      outcome.fault = FrameFault::kNotANumber;
      outcome.where = word;
      return outcome;
    }
    values[outcome.found] = *value * scale_[outcome.found];
    ++outcome.found;
  }
  if (outcome.found < scale_.size()) outcome.fault = FrameFault::kTooFew;
  return outcome;
}

}  // namespace posed::clip
