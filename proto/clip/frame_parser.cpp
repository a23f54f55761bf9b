#include "proto/clip/frame_parser.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <charconv>
#include <cmath>
#include <cstring>

#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

static_assert(std::endian::native == std::endian::little, "frames of numbers are little-endian");

std::string counted(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " value" : " values");
}

// What numpy, pandas, R, JSON, spreadsheets and printf write for a value that is not there.
RT_SAFE bool is_missing(std::string_view field) noexcept {
  constexpr std::array<std::string_view, 8> kWords{"",     "nan",  "na", "n/a",
                                                   "null", "none", "-",  "nan(ind)"};
  if (field.size() > 1 && (field[0] == '-' || field[0] == '+')) field.remove_prefix(1);
  return std::ranges::any_of(kWords, [field](std::string_view word) {
    return std::ranges::equal(field, word, {}, [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
  });
}

std::vector<double> limits(const Skeleton& skeleton) {
  std::vector<double> limit;
  limit.reserve(skeleton.channels.size());
  for (const Channel& channel : skeleton.channels) {
    limit.push_back(channel.translation ? kMaxPosition_m : kMaxAngle_rad);
  }
  return limit;
}

std::vector<double> scales(const Skeleton& skeleton, double metres_per_unit, double radians) {
  std::vector<double> scale;
  scale.reserve(skeleton.channels.size());
  for (const Channel& channel : skeleton.channels) {
    scale.push_back(channel.translation ? metres_per_unit : radians);
  }
  return scale;
}

}  // namespace

std::string FrameOutcome::sentence() const {
  switch (fault) {
    case FrameFault::kNone:
      return "the frame is good";
    case FrameFault::kNotANumber:
      return in_quotes(where) + " is not a number a pose can have";
    case FrameFault::kImplausible:
      return in_quotes(where) +
             " is beyond what a pose can have: a position lies within 1 km, a joint turns by at "
             "most 100 turns, a finger's by 2; is the unit right?";
    case FrameFault::kNoTime:
      return in_quotes(where) +
             " is no time: the first column counts seconds, from the start of the recording or "
             "from 1970";
    case FrameFault::kTooFew:
    case FrameFault::kTooMany:
      return (where.empty() ? std::string("the frame") : "bone " + in_quotes(where)) + " has " +
             counted(found) + (fault == FrameFault::kTooMany ? " or more" : "") +
             " where its channels need " + std::to_string(expected) +
             "; the file is damaged or cut off here, or belongs to another skeleton";
    case FrameFault::kUnknownBone:
      return "the skeleton has no bone " + in_quotes(where) +
             "; is this the right skeleton for the clip?";
    case FrameFault::kRepeatedBone:
      return "bone " + in_quotes(where) + " appears twice in the frame";
    case FrameFault::kMissingBone:
      return "bone " + in_quotes(where) +
             " is missing from the frame; the file is damaged or cut off here, or belongs to "
             "another skeleton";
    case FrameFault::kNoNumber:
      return in_quotes(where) + " stands where a frame's number should";
  }
  return {};
}

FrameParser FrameParser::bvh(const Skeleton& skeleton, double metres_per_unit,
                             std::span<const double> factors) {
  FrameParser parser;
  parser.scale_ = scales(skeleton, metres_per_unit, kDegree);
  std::size_t c = 0;
  for (const double factor : factors) {
    parser.left_out_.push_back(factor == 0.0 ? 1 : 0);
    if (factor != 0.0) parser.scale_[c++] *= factor;
  }
  parser.limit_ = limits(skeleton);
  return parser;
}

FrameParser FrameParser::amc(const Acclaim& acclaim, bool degrees) {
  FrameParser parser;
  parser.scale_ = scales(acclaim.skeleton, acclaim.metres_per_unit, degrees ? kDegree : 1.0);
  parser.limit_ = limits(acclaim.skeleton);
  parser.bones_ = acclaim.bones;
  std::ranges::sort(parser.bones_, {}, &AcclaimBone::name);
  parser.lines_ += static_cast<std::size_t>(std::ranges::count_if(
      parser.bones_, [](const AcclaimBone& bone) { return !bone.channels.empty(); }));
  return parser;
}

FrameParser FrameParser::hand_csv() {
  FrameParser parser;
  parser.scale_.assign(kHandChannels, 1.0);
  parser.limit_.assign(kHandChannels, kMaxHandAngle_rad);
  parser.timed_ = true;
  return parser;
}

FrameParser FrameParser::numbers(const Skeleton& skeleton, bool timed, bool timecoded) {
  FrameParser parser;
  parser.scale_ = scales(skeleton, 1.0, 1.0);
  parser.limit_ = limits(skeleton);
  parser.timed_ = timed;
  parser.timecoded_ = timecoded;
  parser.is_text_ = false;
  return parser;
}

bool FrameParser::keep(double value, std::size_t channel, std::span<double> values) const noexcept {
  values[channel] = value * scale_[channel];
  // NaN marks a missing value and is accepted.
  return !(std::abs(values[channel]) > limit_[channel]);
}

FrameOutcome FrameParser::parse(std::string_view text, std::span<double> values) const noexcept {
  if (!is_text_) return parse_numbers(text, values);
  if (timed_) return parse_fields(text, values);
  return bones_.empty() ? parse_line(text, values) : parse_block(text, values);
}

FrameOutcome FrameParser::parse_line(std::string_view text,
                                     std::span<double> values) const noexcept {
  FrameOutcome outcome;
  const char* const begin = text.data();
  const std::size_t columns = left_out_.empty() ? scale_.size() : left_out_.size();
  outcome.expected = values.size() < scale_.size() ? values.size() : columns;
  std::size_t channel = 0;
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    outcome.offset = static_cast<std::size_t>(word.data() - begin);
    if (outcome.found == outcome.expected) {
      outcome.fault = FrameFault::kTooMany;
      ++outcome.found;
      return outcome;
    }
    const auto value = parse_number(word);
    const bool left_out = !left_out_.empty() && left_out_[outcome.found] != 0;
    if (!value || (!left_out && !keep(*value, channel++, values))) {
      outcome.fault = value ? FrameFault::kImplausible : FrameFault::kNotANumber;
      outcome.where = word;
      return outcome;
    }
    ++outcome.found;
  }
  if (outcome.found < columns) outcome.fault = FrameFault::kTooFew;
  return outcome;
}

FrameOutcome FrameParser::parse_fields(std::string_view text,
                                       std::span<double> values) const noexcept {
  constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
  FrameOutcome outcome;
  outcome.expected = 1 + kHandChannels;
  const char* const begin = text.data();
  const auto add_error = [&](FrameFault fault, std::string_view where) {
    outcome.fault = fault;
    outcome.where = where;
    return outcome;
  };
  if (values.size() < kHandChannels) return add_error(FrameFault::kTooFew, {});
  text = trim(text);
  for (bool more = true; more; ++outcome.found) {
    const std::size_t comma = text.find(',');
    const std::string_view field = trim(text.substr(0, comma));
    outcome.offset = static_cast<std::size_t>(text.data() - begin);
    more = comma != std::string_view::npos;
    text.remove_prefix(more ? comma + 1 : text.size());
    if (outcome.found == outcome.expected) {
      ++outcome.found;
      return add_error(FrameFault::kTooMany, {});
    }
    const auto value = is_missing(field)    ? std::optional(kMissing)
                       : outcome.found == 0 ? parse_number(field, kMaxTime_s)
                                            : parse_number(field);
    if (!value) {
      return add_error(outcome.found == 0 ? FrameFault::kNoTime : FrameFault::kNotANumber, field);
    }
    if (outcome.found == 0) {
      outcome.time_s = *value;
    } else if (!keep(*value, kChannelOfAngle[outcome.found - 1], values)) {
      return add_error(FrameFault::kImplausible, field);
    }
  }
  return outcome.found < outcome.expected ? add_error(FrameFault::kTooFew, {}) : outcome;
}

FrameOutcome FrameParser::parse_numbers(std::string_view bytes,
                                        std::span<double> values) const noexcept {
  FrameOutcome outcome;
  outcome.expected = channels();
  if (bytes.size() != frame_bytes() || values.size() < channels()) {
    outcome.fault = bytes.size() < frame_bytes() ? FrameFault::kTooFew : FrameFault::kTooMany;
    return outcome;
  }
  const auto next = [&bytes] {
    double value = 0.0;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
  };
  if (timed_) outcome.time_s = next();
  if (std::isinf(outcome.time_s) || std::abs(outcome.time_s) > kMaxTime_s) {
    outcome.fault = FrameFault::kImplausible;
    return outcome;
  }
  if (timecoded_) {
    const std::string_view text = bytes.substr(0, sizeof(Timecode));
    outcome.timecode = to_timecode(text.substr(0, text.find('\0')));
    bytes.remove_prefix(sizeof(Timecode));
  }
  for (; outcome.found < outcome.expected; ++outcome.found) {
    if (keep(next(), outcome.found, values)) continue;
    outcome.fault = FrameFault::kImplausible;
    return outcome;
  }
  return outcome;
}

int FrameParser::find_bone(std::string_view name) const noexcept {
  const auto at = std::ranges::lower_bound(
      bones_, name, {}, [](const AcclaimBone& bone) { return std::string_view(bone.name); });
  return at != bones_.end() && at->name == name ? static_cast<int>(at - bones_.begin()) : -1;
}

FrameOutcome FrameParser::parse_block(std::string_view text,
                                      std::span<double> values) const noexcept {
  FrameOutcome outcome;
  const std::string_view whole = text;
  const auto add_error = [&](FrameFault fault, std::string_view where, std::string_view word) {
    outcome.fault = fault;
    outcome.where = where;
    outcome.offset = static_cast<std::size_t>(word.data() - whole.data());
    return outcome;
  };
  std::string_view word = next_word(text);
  const auto number = std::from_chars(word.data(), word.data() + word.size(), outcome.number);
  if (word.empty() || number.ec != std::errc() || number.ptr != word.data() + word.size()) {
    return add_error(FrameFault::kNoNumber, word, word);
  }
  if (values.size() < scale_.size()) return add_error(FrameFault::kTooMany, {}, word);
  std::bitset<kMaxJoints> seen;
  word = next_word(text);
  while (!word.empty()) {
    const int index = find_bone(word);
    if (index < 0) return add_error(FrameFault::kUnknownBone, word, word);
    const AcclaimBone& bone = bones_[index];
    if (seen[index]) return add_error(FrameFault::kRepeatedBone, word, word);
    seen[index] = true;
    outcome.expected = bone.channels.size();
    outcome.found = 0;
    const std::string_view name = word;
    for (word = next_word(text); !word.empty(); word = next_word(text)) {
      const auto value = parse_number(word);
      if (!value && find_bone(word) >= 0) break;
      if (!value) {
        const bool ends = outcome.found == outcome.expected;
        return add_error(ends ? FrameFault::kUnknownBone : FrameFault::kNotANumber, word, word);
      }
      if (outcome.found < outcome.expected) {
        const std::size_t channel = bone.channels[outcome.found];
        if (!keep(*value, channel, values)) return add_error(FrameFault::kImplausible, word, word);
      }
      ++outcome.found;
    }
    if (outcome.found < outcome.expected) return add_error(FrameFault::kTooFew, bone.name, name);
    if (outcome.found > outcome.expected) return add_error(FrameFault::kTooMany, bone.name, name);
  }
  for (std::size_t i = 0; i < bones_.size(); ++i) {
    if (!seen[i] && !bones_[i].channels.empty()) {
      return add_error(FrameFault::kMissingBone, bones_[i].name, whole.substr(0, 0));
    }
  }
  return outcome;
}

std::string frame_bytes(std::optional<double> time_s, const std::optional<Timecode>& timecode,
                        std::span<const double> values) {
  std::string bytes;
  const auto add = [&bytes](double value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  if (time_s) add(*time_s);
  if (timecode) bytes.append(timecode->data(), timecode->size());
  for (const double value : values) add(value);
  return bytes;
}

}  // namespace posed::clip
