#include "proto/clip/timecode_cut.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/clip/text.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

constexpr int kDay_s = 24 * 3600;
constexpr int kParts = 1000;  // of a second by its numbers; a frame takes one, or it is one ms

// The fields of "hh:mm:ss:ff" or "hh:mm:ss.mmm"; empty if the text has neither form.
std::optional<TimecodeMoment> fields_of(std::string_view text) {
  const Timecode code = to_timecode(text);
  if (code == Timecode{}) return std::nullopt;
  const auto two = [&code](std::size_t at) { return 10 * (code[at] - '0') + code[at + 1] - '0'; };
  TimecodeMoment moment{.second = 3600 * two(0) + 60 * two(3) + two(6), .part = two(9)};
  if (two(0) > 23 || two(3) > 59 || two(6) > 59) return std::nullopt;
  moment.milliseconds = code[8] == '.';
  if (moment.milliseconds) moment.part = 10 * moment.part + code[11] - '0';
  return moment;
}

std::optional<TimecodeRate> rate_of(std::string_view text) {
  const auto asked = parse_number(text);
  if (!asked) return std::nullopt;
  for (const int counted : {24, 25, 30, 48, 50, 60, 100, 120}) {
    if (*asked == counted) return TimecodeRate{.counted = counted, .per_s = 1.0 * counted};
    const double slower = counted / 1.001;  // 23.976, 29.97, 59.94, also written 23.98
    const bool has_slower = counted % 25 != 0;
    if (has_slower && std::abs(*asked - slower) < 0.0051) {
      return TimecodeRate{.counted = counted, .per_s = slower};
    }
  }
  return std::nullopt;
}

// Numbers that drop frame leaves out at the beginning of a minute.
int dropped_in_a_minute(const TimecodeRate& rate) { return rate.counted / 15; }

// The frame since midnight.
std::int64_t frame_of(const TimecodeMoment& moment, const TimecodeRate& rate) {
  const std::int64_t minutes = moment.second / 60;
  const std::int64_t numbers = std::int64_t{moment.second} * rate.counted + moment.part;
  return rate.drops ? numbers - dropped_in_a_minute(rate) * (minutes - minutes / 10) : numbers;
}

Result<> check_drop(const TimecodeMoment& moment, std::string_view text) {
  const auto& rate = moment.rate;
  if (!moment.drops) return {};
  if (rate && (rate->counted % 30 != 0 || rate->per_s == rate->counted)) {
    return misuse(in_quotes(text) +
                  " has a ';', but only 29.97, 59.94 and 119.88 frames a second"
                  " have drop frame; write ':'");
  }
  const int dropped = rate ? dropped_in_a_minute(*rate) : 2;
  if (moment.second % 60 == 0 && moment.second / 60 % 10 != 0 && moment.part < dropped) {
    return misuse("timecode " + in_quotes(text) +
                  " is one of those that drop frame leaves out;"
                  " its minute begins with frame " +
                  std::to_string(dropped));
  }
  return {};
}

// Counts one timecode on to the next ones, through midnight and through a generator's jumps.
class Unwrapped {
 public:
  // Since the first one.
  std::int64_t add(std::int64_t key, std::int64_t day) {
    if (last_) at_ += signed_part(key - *last_, day);
    last_ = key;
    return at_;
  }
  static std::int64_t signed_part(std::int64_t apart, std::int64_t day) {
    const std::int64_t ahead = ((apart % day) + day) % day;
    return 2 * ahead > day ? ahead - day : ahead;
  }

 private:
  std::optional<std::int64_t> last_;
  std::int64_t at_ = 0;
};

// What the clip's frames say.
struct Counted {
  std::vector<std::optional<TimecodeMoment>> moment;  // [frame]
  std::size_t first = 0;                              // that has one
  std::size_t known = 0;
  bool milliseconds = false;
  int most = 0;  // the greatest number of a frame in its second
};

Counted counted_of(const Clip& clip) {
  Counted out;
  for (const Timecode& code : clip.timecode) {
    out.moment.push_back(fields_of(view_of(code)));
    if (!out.moment.back()) continue;
    if (out.known++ == 0) out.first = out.moment.size() - 1;
    out.milliseconds = out.moment.back()->milliseconds;
    out.most = std::max(out.most, out.moment.back()->part);
  }
  return out;
}

// Where each frame and a moment stand on one count, whose zero is the clip's first known timecode.
class Ruler {
 public:
  static Result<Ruler> make(const Clip& clip, const std::optional<TimecodeMoment>& from,
                            const std::optional<TimecodeMoment>& to) {
    Ruler ruler;
    const Counted counted = counted_of(clip);
    if (counted.known == 0) {
      return misuse("carries no timecode; its source sends none, or its format keeps none",
                    clip.path);
    }
    for (const auto& end : {from, to}) {
      if (!end) continue;
      if (end->rate) ruler.rate_ = end->rate;
      if (end->drops && ruler.rate_) ruler.rate_->drops = true;
    }
    ruler.by_time_ = 2 * counted.known < counted.moment.size();
    ruler.milliseconds_ = counted.milliseconds;
    TRY(ruler.check(clip, counted, from, to));
    ruler.zero_ = ruler.key(*counted.moment[counted.first]);
    ruler.count(clip, counted);
    return ruler;
  }

  // Of the frame; negative before the first known one.
  [[nodiscard]] double at(std::size_t frame) const { return at_[frame]; }
  [[nodiscard]] double end() const { return *std::ranges::max_element(at_); }
  [[nodiscard]] double of(const TimecodeMoment& moment) const {
    return static_cast<double>(Unwrapped::signed_part(key(moment) - zero_, day()));
  }

 private:
  // Seconds by their numbers and frames, of which only the order counts; by time, whole frames.
  [[nodiscard]] std::int64_t key(const TimecodeMoment& moment) const {
    if (by_time_) return frame_of(moment, *rate_);
    const int part =
        milliseconds_ && !moment.milliseconds ? moment.part * kParts / rate_->counted : moment.part;
    return std::int64_t{moment.second} * kParts + part;
  }
  [[nodiscard]] std::int64_t day() const {
    return by_time_ ? frame_of({.second = kDay_s}, *rate_) : std::int64_t{kDay_s} * kParts;
  }

  Result<> check(const Clip& clip, const Counted& counted,
                 const std::optional<TimecodeMoment>& from,
                 const std::optional<TimecodeMoment>& to) const {
    const auto text = [&](std::size_t frame) { return std::string(view_of(clip.timecode[frame])); };
    for (const auto& end : {from, to}) {
      if (!end) continue;
      if (end->milliseconds && !milliseconds_) {
        return misuse("counts frames (" + text(counted.first) + "); write hh:mm:ss:ff", clip.path);
      }
      if (!end->milliseconds && !rate_ && (milliseconds_ || by_time_)) {
        return misuse((by_time_ ? "carries a timecode only now and then, first "
                                : "counts milliseconds, first ") +
                          text(counted.first) +
                          "; say how many frames a second has, as 10:20:30:05@25",
                      clip.path);
      }
      const bool counts = !milliseconds_ && !by_time_;
      const bool saw_a_second = clip.frames() > 2.0 * clip.frame_rate_hz;
      if (counts && ((rate_ && counted.most >= rate_->counted) ||
                     (saw_a_second && end->part > counted.most))) {
        return misuse("counts frames 0 to " + std::to_string(counted.most) +
                          " in a second, which is another rate than that of the timecode asked for",
                      clip.path);
      }
    }
    return {};
  }

  void count(const Clip& clip, const Counted& counted) {
    Unwrapped unwrapped;
    std::size_t known = counted.first;
    double at_known = 0.0;
    at_.resize(counted.moment.size());
    const auto time_s = [&](std::size_t frame) { return clip.time_of_s(static_cast<int>(frame)); };
    for (std::size_t i = 0; i < at_.size(); ++i) {
      if (counted.moment[i]) {
        at_known = static_cast<double>(unwrapped.add(key(*counted.moment[i]), day()));
        known = i;
      }
      at_[i] = at_known;
      if (by_time_) at_[i] += (time_s(i) - time_s(known)) * rate_->per_s;
      if (!by_time_ && i < counted.first) at_[i] = -1.0;
    }
  }

  std::optional<TimecodeRate> rate_{};
  bool by_time_ = false, milliseconds_ = false;
  std::int64_t zero_ = 0;
  std::vector<double> at_;  // [frame]
};

}  // namespace

Result<TimecodeMoment> parse_timecode(std::string_view text) {
  const std::size_t end = std::min(text.find('@'), text.size());
  std::string code(text.substr(0, end));
  const bool drops = code.size() == 11 && code[8] == ';';
  if (drops) code[8] = ':';
  auto moment = fields_of(code);
  if (!moment) {
    return misuse(in_quotes(text) +
                  " is no timecode; write hh:mm:ss:ff, hh:mm:ss;ff for drop frame,"
                  " or hh:mm:ss.mmm");
  }
  moment->drops = drops;
  if (end < text.size()) {
    moment->rate = rate_of(text.substr(end + 1));
    if (!moment->rate || moment->milliseconds) {
      return misuse(in_quotes(text) +
                    " has a rate that timecode does not have; behind frames may"
                    " stand @23.976, 24, 25, 29.97, 30, 47.95, 48, 50, 59.94, 60,"
                    " 100, 119.88 or 120");
    }
    moment->rate->drops = drops;
    if (moment->part >= moment->rate->counted) {
      return misuse("timecode " + in_quotes(text) + " has no frame " +
                    std::to_string(moment->part) + ": a second counts 0 to " +
                    std::to_string(moment->rate->counted - 1));
    }
  }
  TRY(check_drop(*moment, text));
  return *moment;
}

Result<Clip> cut_by_timecode(Clip clip, std::string_view from, std::string_view to) {
  std::optional<TimecodeMoment> begin, end;
  if (!from.empty()) begin = TRY(parse_timecode(from));
  if (!to.empty()) end = TRY(parse_timecode(to));
  if (!begin && !end) return clip;
  const auto ruler = TRY(Ruler::make(clip, begin, end));
  const std::size_t frames = clip.timecode.size();
  std::size_t first = 0;
  while (begin && first < frames && ruler.at(first) < ruler.of(*begin)) ++first;
  std::size_t last = first;
  while (last < frames && (!end || ruler.at(last) <= ruler.of(*end))) ++last;
  const auto known = [](const Timecode& code) { return !view_of(code).empty(); };
  if (first == last) {
    const auto begins = std::ranges::find_if(clip.timecode, known);
    const auto ends = std::ranges::find_if(clip.timecode.rbegin(), clip.timecode.rend(), known);
    return misuse("has no frame " + (from.empty() ? "" : "from " + std::string(from) + " ") +
                      (to.empty() ? "" : "to " + std::string(to) + " ") + "in its timecode, " +
                      std::string(view_of(*begins)) + " to " + std::string(view_of(*ends)),
                  clip.path);
  }
  if (begin && ruler.of(*begin) < 0.0) {
    clip.warnings.push_back("begins later than timecode " + std::string(from));
  }
  keep_frames(clip, static_cast<int>(first), static_cast<int>(last));
  return clip;
}

}  // namespace posed::clip
