// The calibration of Shadow's ROS driver: XML; a raw value from 0 to 1 stands for 1 to 255 counts;
// calibrated values in degrees, flexion and spread positive; two points or more in any order.
#include <algorithm>
#include <array>

#include "drivers/glove/import_parts.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

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

}  // namespace

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

}  // namespace posed::drivers::glove
