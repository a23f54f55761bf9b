#include "drivers/glove/angle_map.hpp"

#include <algorithm>
#include <utility>

#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::drivers::glove {
namespace {

constexpr double kMaxGain = 1000.0;
constexpr double kMaxOffset_deg = 360.0;

void read_share(TableReader& share, std::uint8_t sensor, Findings& findings,
                std::vector<MapRow>& rows) {
  std::string channel;
  double gain = 1.0;
  double offset_deg = 0.0;
  share.need("channel", "write channel = \"index1_x\", for example");
  share.read("channel", channel);
  share.read("gain", gain, {-kMaxGain, kMaxGain});
  share.read("offset_deg", offset_deg, {-kMaxOffset_deg, kMaxOffset_deg});
  share.finish();
  const int index = hand_channel(channel);
  if (index < 0) share.add_error("channel", "the hand has no channel " + in_quotes(channel));
  if (rows.size() == kMaxMapRows) share.add_error("channel", "too many angles in one table");
  if (!findings.errors.empty()) return;
  rows.push_back({.sensor = sensor,
                  .channel = static_cast<std::uint8_t>(index),
                  .gain = static_cast<float>(gain),
                  .offset_rad = static_cast<float>(offset_deg * kDegree)});
}

void read_angles(TableReader& angles, const std::vector<Sensor>& sensors, Findings& findings,
                 std::vector<MapRow>& rows) {
  for (const std::string& name : angles.keys()) {
    const auto sensor = std::ranges::find(sensors, name, &Sensor::name);
    if (sensor == sensors.end()) {
      angles.add_error(name, "the glove has no value " + in_quotes(name));
      continue;
    }
    for (TableReader& share : angles.tables(name, kMaxMapRows)) {
      read_share(share, static_cast<std::uint8_t>(sensor - sensors.begin()), findings, rows);
    }
  }
}

}  // namespace

Result<Model> with_device_table(Model model, std::string_view name) {
  const std::string file = std::string(name) + ".toml";
  for (const ConfigText& text : device_texts()) {
    if (text.file != file) continue;
    model.map_toml = text.content;
    return model;
  }
  return fail("this posed was built without config/devices/" + file);
}

Result<std::vector<MapRow>> parse_angle_map(const std::string& toml, const std::string& file,
                                            const std::vector<Sensor>& sensors) {
  const auto table = TRY(parse_toml(toml, file, {.what = "device description"}));
  Findings findings{.file = file};
  TableReader reader(table, "", findings);
  std::vector<MapRow> rows;
  reader.need("angles", "it says which joints of the hand each value moves");
  if (auto angles = reader.table("angles")) read_angles(*angles, sensors, findings, rows);
  return findings.result(std::move(rows));
}

int hand_channel(std::string_view name) {
  for (int finger = 0; finger < kFingers; ++finger) {
    const std::string_view start = kFingerNames[finger];
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
