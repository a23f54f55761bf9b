// The user calibration of VirtualHand, as read by vt_read_user_cal.cpp in VR Juggler: six blocks of
// four lines "joint offset gain gesture", separated by any blanks. An angle is -gain (raw -
// offset). The "index abduction" gain scales the sensor between index and middle finger; the
// "middle abduction" gain is the bias.
#include <array>
#include <vector>

#include "drivers/glove/import_parts.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers::glove {
namespace {

constexpr std::size_t kJoints = 24;
constexpr std::size_t kIndexAbd = 7, kMiddleAbd = 11;
constexpr double kCounts = 100.0;  // distance between the two points that are written for a line

constexpr std::array<std::string_view, kJoints> kVirtualHandNames{
    "thumb_roll", "thumb_mcp",  "thumb_ip",   "thumb_abd",   "index_mcp",  "index_pip",
    "index_dip",  "",           "middle_mcp", "middle_pip",  "middle_dip", "middle_abd",
    "ring_mcp",   "ring_pip",   "ring_dip",   "ring_abd",    "little_mcp", "little_pip",
    "little_dip", "little_abd", "palm_arch",  "wrist_pitch", "wrist_yaw",  ""};

struct Row {
  double offset = 0.0;
  double gain = 0.0;
};

// Returns the numbers of a line: joint, offset, gain and the rest; empty for a label or a comment.
std::vector<double> numbers_of(std::string_view line) {
  std::vector<double> numbers;
  while (!line.empty()) {
    const std::string_view word = clip::next_word(line);
    if (word.empty()) break;
    const auto number = clip::parse_number(word);
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

Side side_of(std::string_view text, Side without) {
  const std::size_t at = text.find("HAND GEOMETRY");
  if (at == std::string_view::npos) return without;
  std::string_view rest = text.substr(at);
  (void)clip::next_line(rest);
  while (!rest.empty()) {
    const std::string_view word = clip::next_word(rest);
    if (word.empty()) break;
    if (word == "R" || word == "L") return word == "L" ? Side::kLeft : Side::kRight;
  }
  return without;
}

}  // namespace

Result<> import_virtual_hand(std::string_view text, const std::string& file,
                             CalibrationFile& into) {
  std::vector<Row> rows;
  std::string_view rest = text;
  for (int line = 1; !rest.empty() && rows.size() < kJoints; ++line) {
    const std::vector<double> numbers = numbers_of(clip::next_line(rest));
    if (numbers.empty()) continue;
    if (numbers.size() < 3) return cut_off(file, line);
    if (numbers[0] != static_cast<double>(rows.size() % 4)) {
      return fail("a block should have the joints 0 to 3 in order", file, line);
    }
    rows.push_back({.offset = numbers[1], .gain = numbers[2]});
  }
  if (rows.size() < kJoints) return cut_off(file);
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (kVirtualHandNames[i].empty()) continue;
    const double slope = i == kMiddleAbd ? rows[kIndexAbd].gain : -rows[i].gain;
    into.sensors[std::string(kVirtualHandNames[i])] = {{rows[i].offset, 0.0},
                                                       {rows[i].offset + kCounts, slope * kCounts}};
  }
  into.parameters["abduction_bias"] = rows[kMiddleAbd].gain;
  into.hand = side_of(text, into.hand);
  return {};
}

}  // namespace posed::drivers::glove
