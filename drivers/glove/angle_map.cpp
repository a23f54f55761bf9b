#include "drivers/glove/angle_map.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"
#include "proto/frame/profile_texts.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/toml.hpp"

namespace posed::drivers::glove {
namespace {

constexpr double kMaxGain = 1000.0;
constexpr double kMaxOffset_deg = 360.0;

class MapReader : private FirstError {
 public:
  MapReader(const std::string& file, const std::vector<Sensor>& sensors)
      : FirstError(file), sensors_(sensors) {}

  Result<std::vector<MapRow>> read(const toml::table& table) {
    const toml::table* const angles = table["angles"].as_table();
    if (angles == nullptr) add_error(table, "the device's table lacks [angles]");
    if (angles != nullptr) {
      for (const auto& [key, node] : *angles) read_value(key.str(), node);
    }
    if (error()) return std::unexpected(*error());
    return std::move(rows_);
  }

 private:
  void read_value(std::string_view name, const toml::node& node) {
    const auto sensor = std::ranges::find(sensors_, name, &Sensor::name);
    if (sensor == sensors_.end()) {
      return add_error(node, "the glove has no value " + in_quotes(name));
    }
    const toml::array* const shares = node.as_array();
    if (shares == nullptr)
      return add_error(node, "a list of {channel, gain, offset_deg} is wanted");
    for (const toml::node& share : *shares) {
      if (!share.is_table())
        return add_error(share, "{channel = \"index1_x\", gain = 1} is wanted");
      read_share(static_cast<std::uint8_t>(sensor - sensors_.begin()), *share.as_table());
    }
  }

  void read_share(std::uint8_t sensor, const toml::table& share) {
    for (const auto& [key, node] : share) {
      if (key != "channel" && key != "gain" && key != "offset_deg") {
        add_error(node, in_quotes(key.str()) + " is not known in an angle");
      }
    }
    const std::string channel = share["channel"].value_or(std::string());
    const int index = hand_channel(channel);
    if (index < 0) add_error(share, "the hand has no channel " + in_quotes(channel));
    if (rows_.size() == kMaxMapRows) add_error(share, "too many angles in one table");
    if (error()) return;
    rows_.push_back({.sensor = sensor,
                     .channel = static_cast<std::uint8_t>(index),
                     .gain = static_cast<float>(number(share, "gain", 1.0, kMaxGain)),
                     .offset_rad = static_cast<float>(
                         number(share, "offset_deg", 0.0, kMaxOffset_deg) * kDegree)});
  }

  double number(const toml::table& share, std::string_view key, double without, double most) {
    const toml::node* const node = share.get(key);
    if (node == nullptr) return without;
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (value && std::abs(*value) <= most) return *value;
    add_error(*node, std::string(key) + " is a number of a size that fits a hand");
    return without;
  }

  const std::vector<Sensor>& sensors_;
  std::vector<MapRow> rows_;
};

}  // namespace

Result<std::string> device_table(std::string_view name) {
  const std::string file = std::string(name) + ".toml";
  for (const ProfileText& text : device_texts()) {
    if (text.file == file) return std::string(text.toml);
  }
  return fail("this posed was built without config/devices/" + file);
}

Result<std::vector<MapRow>> parse_angle_map(const std::string& toml, const std::string& file,
                                            const std::vector<Sensor>& sensors) {
  const auto table = parse_toml(toml, file, {.what = "device description"});
  if (!table) return std::unexpected(table.error());
  return MapReader(file, sensors).read(*table);
}

int hand_channel(std::string_view name) {
  for (int finger = 0; finger < kFingers; ++finger) {
    const std::string_view start = kFingerNames[static_cast<std::size_t>(finger)];
    if (!name.starts_with(start)) continue;
    name.remove_prefix(start.size());
    if (name.size() != 3 || name[0] < '1' || name[0] > '3' || name[1] != '_' || name[2] < 'x' ||
        name[2] > 'z') {
      return -1;
    }
    return finger * kFingerChannels + (name[0] - '1') * 3 + (name[2] - 'x');
  }
  return -1;
}

}  // namespace posed::drivers::glove
