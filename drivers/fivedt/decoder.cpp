#include "drivers/fivedt/decoder.hpp"

#include <algorithm>
#include <numbers>

#include "drivers/glove/angle_map.hpp"

namespace posed::drivers::fivedt {
namespace {

constexpr std::array<std::string_view, kMaxValues> kWideNames{
    "thumb_near",  "thumb_far",  "thumb_index", "index_near", "index_far", "index_middle",
    "middle_near", "middle_far", "middle_ring", "ring_near",  "ring_far",  "ring_little",
    "little_near", "little_far", "thumb_palm",  "wrist_bend"};

bool has_tilt(Form form) noexcept { return form == Form::kFive || form == Form::kFiveWireless; }

}  // namespace

Result<glove::Model> model(Form form) {
  glove::Model model{.driver = "fivedt", .sensors = {}};
  const bool narrow = sensors_of(form) == kFingers;
  for (std::size_t i = 0; i < sensors_of(form); ++i) {
    glove::Sensor sensor{.name = std::string(narrow ? kFingerNames[i] : kWideNames[i]),
                         .raw_max = has_tilt(form) ? 255.0 : 4095.0,
                         .curve = {},
                         .unit = "1"};
    sensor.curve = has_tilt(form) ? glove::Curve::line(0.0, 0.0, 255.0, 1.0)
                                  : glove::Curve::line(kStraight, 0.0, kBent, 1.0);
    model.sensors.push_back(std::move(sensor));
  }
  return glove::with_device_table(std::move(model), narrow ? "fivedt-5" : "fivedt-14");
}

SampleLayout layout(const glove::Model& model, Form form) {
  if (!has_tilt(form)) return glove::sample_layout(model);
  const std::array<std::string, 2> extras{"pitch", "roll"};
  SampleLayout layout = glove::sample_layout(model, extras);
  std::fill_n(layout.units.rbegin(), extras.size(), "rad");
  return layout;
}

RT_SAFE void FiveDtDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                 Sink& sink) noexcept {
  sink_ = &sink;
  framer_.feed(bytes, *this);
  sink_ = nullptr;
}

RT_SAFE void FiveDtDecoder::reading(const Reading& reading) noexcept {
  const bool mine = settings_.form != Form::kUltraWireless || reading.port_b == settings_.port_b;
  if (reading.kind != Reading::Kind::kData || !mine) return;
  const std::size_t sensors = sensors_of(settings_.form);
  std::array<float, glove::kMaxSensors> raw{};
  glove::Packet packet{.raw = std::span(raw).first(sensors), .valid = {}, .extra = {}};
  for (std::size_t i = 0; i < sensors; ++i) {
    raw[i] = static_cast<float>(reading.value[value_of_sensor(settings_.form, i)]);
    packet.valid[i] = true;
  }
  constexpr float kTilt_rad = std::numbers::pi_v<float> / 255.0F;
  const std::array<float, 2> tilt{kTilt_rad * static_cast<float>(reading.pitch),
                                  kTilt_rad * static_cast<float>(reading.roll)};
  if (has_tilt(settings_.form)) packet.extra = tilt;
  const bool same = has_before_ && before_ == reading.value;
  if (settings_.polled && same) packet.quality = Quality::kHeld;
  before_ = reading.value;
  has_before_ = true;
  emit(packet, *sink_);
}

}  // namespace posed::drivers::fivedt
