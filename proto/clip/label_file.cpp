#include "proto/clip/label_file.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ostream>

#include "proto/clip/text.hpp"
#include "proto/frame/label.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::clip {
namespace {

constexpr double kHtkUnit_s = 1e-7;
// Times that are all integers with the last above this are HTK's.
constexpr double kHtkFrom = 10'000.0;
constexpr std::uintmax_t kMaxLabelFile = 64'000'000;  // bytes
constexpr double kSlack_s = 1e-6;                     // times are written with six decimals

bool is_integer(std::string_view word) {
  return std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
}

// Parses one line; times are not yet in seconds.
Result<LabelSegment> parse_line(std::string_view line, const std::string& file, int number,
                                bool& all_integers) {
  std::array<double, 2> times{};
  for (double& time : times) {
    const std::string_view word = next_word(line);
    const auto value = parse_number(word);
    if (!value) {
      return fail(word.empty() ? "a label line has a start, an end and a name; this one ends early"
                               : in_quotes(word) + " is no time; write seconds or HTK's integers",
                  file, number);
    }
    if (*value < 0.0)
      return fail("a time below zero; times begin with the recording", file, number);
    all_integers = all_integers && is_integer(word);
    time = *value;
  }
  const std::string_view name = next_word(line);
  if (!is_label_name(name)) {
    return fail(name.empty() ? "the segment has no name"
                             : in_quotes(name) +
                                   " is no label; use 1 to 15 letters, digits or "
                                   "signs of ASCII without a blank",
                file, number);
  }
  if (!trim(line).empty()) {
    return fail("there is more after the name " + in_quotes(name) +
                    "; a label line has a start, an end and a name",
                file, number);
  }
  return LabelSegment{times[0], times[1], std::string(name), number};
}

Result<> check_order(const std::vector<LabelSegment>& segments, double recording_s,
                     const std::string& file) {
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const LabelSegment& s = segments[i];
    if (s.end_s <= s.start_s) {
      return fail("the segment ends where it starts or before; swap or mend its times", file,
                  s.line);
    }
    if (s.end_s > recording_s + kSlack_s) {
      return fail("the segment ends at " + std::to_string(s.end_s) + " s, the recording at " +
                      std::to_string(recording_s) + " s; is this the right recording?",
                  file, s.line);
    }
    if (i == 0) continue;
    const LabelSegment& before = segments[i - 1];
    if (s.start_s < before.start_s) {
      return fail("the segment starts before the one above; put them in time order", file, s.line);
    }
    if (s.start_s < before.end_s - kSlack_s) {
      return fail("the segment overlaps the one above, which ends at " +
                      std::to_string(before.end_s) + " s",
                  file, s.line);
    }
  }
  return {};
}

}  // namespace

Result<std::vector<LabelSegment>> parse_labels(std::string_view text, const std::string& file,
                                               double recording_s) {
  text = without_bom(text);
  std::vector<LabelSegment> segments;
  bool all_integers = true;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view line = trim(next_line(text));
    if (line.empty()) continue;
    auto segment = TRY(parse_line(line, file, number, all_integers));
    segments.push_back(std::move(segment));
  }
  if (segments.empty()) return fail("there is no label in this file", file);
  if (all_integers && segments.back().end_s > kHtkFrom) {
    for (LabelSegment& s : segments) {
      s.start_s *= kHtkUnit_s;
      s.end_s *= kHtkUnit_s;
    }
  }
  TRY(check_order(segments, recording_s, file));
  return segments;
}

Result<std::vector<LabelSegment>> read_labels(const std::filesystem::path& path,
                                              double recording_s) {
  const auto text = TRY(load_file(path, {.what = "label file", .max_bytes = kMaxLabelFile}));
  return parse_labels(text, path.string(), recording_s);
}

std::string labels_text(const std::vector<LabelSegment>& segments) {
  std::string text;
  for (const LabelSegment& s : segments) {
    std::array<char, 64> times{};
    const int size = std::snprintf(times.data(), times.size(), "%.6f %.6f ", s.start_s, s.end_s);
    text.append(times.data(), static_cast<std::size_t>(size)).append(s.name).append("\n");
  }
  return text;
}

Result<> write_labels(const std::vector<LabelSegment>& segments,
                      const std::filesystem::path& path) {
  return write_whole_file(path, [&](std::ostream& out) { out << labels_text(segments); });
}

}  // namespace posed::clip
