// The calibration of asr_cyberglove_lib: 22 lines "rad1:raw1 rad2:raw2", wrist first, a straight
// line through two points each. There the middle finger's abduction is always 0 (the other fingers
// are measured relative to it), so its line belongs to no sensor. That the other fingers' lines are
// the sensors between the fingers is inferred.
#include <array>

#include "drivers/glove/import_parts.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers::glove {
namespace {

constexpr double kLeastCounts = 10.0;

constexpr std::array<std::string_view, 22> kAsrNames{
    "wrist_yaw",  "wrist_pitch", "thumb_abd",  "thumb_roll", "thumb_mcp",  "thumb_ip",
    "index_mcp",  "middle_abd",  "index_pip",  "index_dip",  "middle_mcp", "",
    "middle_pip", "middle_dip",  "ring_mcp",   "ring_abd",   "ring_pip",   "ring_dip",
    "little_mcp", "little_abd",  "little_pip", "little_dip"};

// Reads a point such as "0.300000:46.000000".
bool read_point(std::string_view word, std::array<double, 2>& point) {
  const std::size_t colon = word.find(':');
  if (colon == std::string_view::npos) return false;
  const auto value = clip::parse_number(word.substr(0, colon));
  const auto raw = clip::parse_number(word.substr(colon + 1));
  if (!value || !raw) return false;
  point = {*raw, *value};
  return true;
}

}  // namespace

Result<> import_asr(std::string_view text, const std::string& file, CalibrationFile& into) {
  std::string_view rest = text;
  for (std::size_t i = 0; i < kAsrNames.size(); ++i) {
    const int number = static_cast<int>(i) + 1;
    std::string_view line = clip::next_line(rest);
    std::array<double, 2> first{}, second{};
    if (!read_point(clip::next_word(line), first) || !read_point(clip::next_word(line), second) ||
        !clip::trim(line).empty()) {
      return cut_off(file, number);
    }
    if (kAsrNames[i].empty() || first[1] == second[1]) continue;  // the sensor keeps its default
    if (first[0] > second[0]) std::swap(first, second);
    if (second[0] - first[0] < kLeastCounts) {
      return fail("sensor '" + std::string(kAsrNames[i]) +
                      "' hardly moved in this calibration (less than 10 counts): calibrate again",
                  file, number);
    }
    into.sensors[std::string(kAsrNames[i])] = {first, second};
  }
  return {};
}

}  // namespace posed::drivers::glove
