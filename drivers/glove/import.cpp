#include "drivers/glove/import.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

std::unexpected<Error> cut_off(const std::string& file, int line = 0) {
  return fail("this calibration is not whole; was the file cut off?", file, line);
}

// The user calibration of VirtualHand, as read by vt_read_user_cal.cpp in VR Juggler: six blocks of
// four lines "joint offset gain gesture", separated by any blanks. An angle is -gain (raw -
// offset). The "index abduction" gain scales the sensor between index and middle finger; the
// "middle abduction" gain is the bias.

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

// The calibration of asr_cyberglove_lib: 22 lines "rad1:raw1 rad2:raw2", wrist first, a straight
// line through two points each. There the middle finger's abduction is always 0 (the other fingers
// are measured relative to it), so its line belongs to no sensor. That the other fingers' lines are
// the sensors between the fingers is inferred.

constexpr double kMinCounts = 10.0;

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
    if (second[0] - first[0] < kMinCounts) {
      return fail("sensor '" + std::string(kAsrNames[i]) +
                      "' hardly moved in this calibration (less than 10 counts): calibrate again",
                  file, number);
    }
    into.sensors[std::string(kAsrNames[i])] = {first, second};
  }
  return {};
}

// The calibration of Shadow's ROS driver: XML; a raw value from 0 to 1 stands for 1 to 255 counts;
// calibrated values in degrees, flexion and spread positive; two points or more in any order.

struct Name {
  std::string_view theirs, ours;
  double sign = -1.0;  // flexion is negative in posed; only this spread keeps its sign
};
constexpr std::array<Name, 22> kShadowNames{{
    {"G_ThumbRotate", "thumb_roll"},
    {"G_ThumbMPJ", "thumb_mcp"},
    {"G_ThumbIJ", "thumb_ip"},
    {"G_ThumbAb", "thumb_abd"},
    {"G_IndexMPJ", "index_mcp"},
    {"G_IndexPIJ", "index_pip"},
    {"G_IndexDIJ", "index_dip"},
    {"G_MiddleMPJ", "middle_mcp"},
    {"G_MiddlePIJ", "middle_pip"},
    {"G_MiddleDIJ", "middle_dip"},
    {"G_MiddleIndexAb", "middle_abd", 1.0},
    {"G_RingMPJ", "ring_mcp"},
    {"G_RingPIJ", "ring_pip"},
    {"G_RingDIJ", "ring_dip"},
    {"G_RingMiddleAb", "ring_abd"},
    {"G_PinkieMPJ", "little_mcp"},
    {"G_PinkiePIJ", "little_pip"},
    {"G_PinkieDIJ", "little_dip"},
    {"G_PinkieRingAb", "little_abd"},
    {"G_PalmArch", "palm_arch"},
    {"G_WristPitch", "wrist_pitch"},
    {"G_WristYaw", "wrist_yaw"},
}};

// Returns the value of key="..." in a tag; empty when it is missing.
std::string_view attribute(std::string_view tag, std::string_view key) {
  const std::string start = " " + std::string(key) + "=\"";
  const std::size_t at = tag.find(start);
  if (at == std::string_view::npos) return {};
  const std::size_t end = tag.find('"', at + start.size());
  return end == std::string_view::npos ? std::string_view()
                                       : tag.substr(at + start.size(), end - at - start.size());
}

Result<> import_shadow(std::string_view text, const std::string& file, CalibrationFile& into) {
  if (!text.contains("<Cyberglove_calibration>")) {
    return fail("is no Cyberglove_calibration of Shadow's driver", file);
  }
  if (!text.ends_with("</Cyberglove_calibration>")) return cut_off(file);
  const Name* joint = nullptr;
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
    const std::string_view tag = text.substr(at, text.find('>', at) - at);
    const int line = 1 + static_cast<int>(std::ranges::count(text.substr(0, at), '\n'));
    if (tag.starts_with("<Joint ")) {
      const auto name = std::ranges::find(kShadowNames, attribute(tag, "name"), &Name::theirs);
      if (name == kShadowNames.end())
        return fail("a Joint has a name that no CyberGlove has", file, line);
      joint = &*name;
    } else if (tag.starts_with("<calib ")) {
      const auto raw = clip::parse_number(attribute(tag, "raw_value"));
      const auto degrees = clip::parse_number(attribute(tag, "calibrated_value"));
      if (joint == nullptr || !raw || !degrees) {
        return fail("a calib needs a Joint around it, raw_value and calibrated_value", file, line);
      }
      into.sensors[std::string(joint->ours)].push_back(
          {1.0 + 254.0 * *raw, joint->sign * *degrees * kDegree});
    }
  }
  for (auto& [name, points] : into.sensors) std::ranges::sort(points);
  return {};
}

}  // namespace

Result<CalibrationFile> import_calibration(const std::filesystem::path& path, const Model& model,
                                           Side hand) {
  const std::string file = path.string();
  if (model.driver != "cyberglove") {
    return fail("calibrations are imported for driver 'cyberglove' only; calibrate this glove",
                file);
  }
  const auto loaded = TRY(load_calibration_text(path));
  const std::string_view text = clip::trim(clip::without_bom(loaded));
  CalibrationFile made{.driver = model.driver,
                       .glove = {},
                       .user = {},
                       .hand = hand,
                       .parameters = {},
                       .sensors = {}};
  const std::string_view first_line = text.substr(0, text.find('\n'));
  Result<> read;
  if (text.starts_with('<')) {
    read = import_shadow(text, file, made);
  } else if (first_line.starts_with("VH") || text.contains("GLOVE CALIBRATION") ||
             text.contains("FINGER ")) {
    read = import_virtual_hand(text, file, made);
  } else if (first_line.contains(':')) {
    read = import_asr(text, file, made);
  } else {
    return fail("is no calibration that posed knows: VirtualHand's or asr's .cal, Shadow's XML",
                file);
  }
  if (!read) return std::unexpected(read.error());
  if (made.hand != hand) {
    return fail(std::string("this calibration is of the other hand; import it with --hand ") +
                    (hand == Side::kLeft ? "right" : "left"),
                file);
  }
  // A file may parse and still be impossible for a hand: compiling it is the final check.
  const auto compiled = make_calibration(model, made, hand, {});
  if (!compiled) return fail(compiled.error().message, file);
  return made;
}

}  // namespace posed::drivers::glove
