#include "drivers/natnet/settings.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/glove/device_info.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::array<std::string_view, 2> kUps{"y", "z"};
constexpr std::array<std::string_view, 3> kCoordinates{"auto", "local", "global"};
constexpr std::array<std::string_view, 2> kCasts{"multi", "uni"};
constexpr std::string_view kAnyVersion = "auto";

}  // namespace

std::string settings_text(const Settings& settings) {
  const auto word = [](const auto& words, auto index) {
    return std::string(words[static_cast<std::size_t>(index)]);
  };
  const Version version = settings.version;
  return "natnet version=" +
         (version.known() ? std::to_string(version.major) + '.' + std::to_string(version.minor)
                          : std::string(kAnyVersion)) +
         " up=" + word(kUps, settings.z_up) +
         " coordinates=" + word(kCoordinates, settings.coordinates) +
         " cast=" + word(kCasts, settings.unicast) + " rate=" + std::to_string(settings.rate_hz);
}

Result<Settings> parse_settings(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, "natnet", identity);
  Settings settings;
  const std::string version = reader.word("version");
  settings.z_up = reader.choice("up", kUps) == 1;
  settings.coordinates = static_cast<Coordinates>(reader.choice("coordinates", kCoordinates));
  settings.unicast = reader.choice("cast", kCasts) == 1;
  settings.rate_hz = reader.whole("rate", 1, 2000);
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  if (version == kAnyVersion) return settings;
  const auto parsed = parse_version(version);
  if (!parsed) return fail(parsed.error().message, identity);
  settings.version = *parsed;
  return settings;
}

Result<bool> parse_up(const std::string& word) {
  if (word == "y" || word == "z") return word == "z";
  return misuse("up should be \"y\" or \"z\", as Motive's up axis is set");
}

Result<Coordinates> parse_coordinates(const std::string& word) {
  const auto at = std::ranges::find(kCoordinates, word);
  if (at != kCoordinates.end()) return static_cast<Coordinates>(at - kCoordinates.begin());
  return misuse(
      "coordinates should be \"auto\", \"local\" or \"global\", as Motive's skeleton coordinates "
      "are set");
}

}  // namespace posed::drivers::natnet
