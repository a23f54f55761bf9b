#include "drivers/glove/glove_decoder.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/plausible.hpp"

namespace posed::drivers::glove {
namespace {

// A value larger than this cannot belong to a hand; it results from a wrong calibration or a
// foreign raw value.
constexpr float kMaxValue = 1e6F;

void drop_what_is_no_number(std::span<const float> value,
                            std::bitset<kMaxSensors>& valid) noexcept {
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!(std::abs(value[i]) <= kMaxValue)) valid[i] = false;
  }
}

// Removes angles that no finger can have; returns false when there were any.
RT_SAFE bool drop_implausible(HandAngles& angles) noexcept {
  bool plausible = true;
  for (double& angle_rad : angles) {
    if (!std::isfinite(angle_rad) || std::abs(angle_rad) <= kMaxHandAngle_rad) continue;
    angle_rad = std::numeric_limits<double>::quiet_NaN();
    plausible = false;
  }
  return plausible;
}

// Fills the values of a Sample in order.
class SampleWriter {
 public:
  explicit SampleWriter(Sample& sample) noexcept : sample_(sample) {}

  void add(float value, bool valid) noexcept {
    const bool finite = valid && std::isfinite(value);
    assert(count_ < kMaxGloveValues);
    valid_ |= std::uint64_t{finite} << count_;
    sample_.value[count_++] = finite ? value : 0.0F;
  }
  void finish() noexcept {
    sample_.valid = valid_;
    sample_.value_count = static_cast<std::uint16_t>(count_);
  }

 private:
  static_assert(kMaxGloveValues <= 64 && kMaxGloveValues <= kMaxSampleValues);

  Sample& sample_;
  std::uint64_t valid_ = 0;
  std::size_t count_ = 0;
};

}  // namespace

SampleLayout sample_layout(const Model& model, std::span<const std::string> extras) {
  SampleLayout layout;
  for (const Sensor& sensor : model.sensors) {
    layout.names.push_back(sensor.name);
    layout.units.push_back(sensor.unit);
  }
  for (const Sensor& sensor : model.sensors) layout.names.push_back("raw_" + sensor.name);
  layout.names.insert(layout.names.end(), extras.begin(), extras.end());
  layout.units.resize(layout.names.size(), "1");
  return layout;
}

GloveDecoder::GloveDecoder(std::shared_ptr<const Skeleton> skeleton,
                           std::shared_ptr<const Calibration> default_calibration)
    : skeleton_(std::move(skeleton)),
      default_(std::move(default_calibration)),
      calibration_(default_.get()) {
  assert(default_ != nullptr && default_->sensors <= kMaxSensors);
}

RT_SAFE void GloveDecoder::compute(std::span<float> /*value*/,
                                   std::bitset<kMaxSensors>& /*valid*/) const noexcept {}

RT_SAFE void GloveDecoder::emit(const Packet& packet, Sink& sink) noexcept {
  const std::size_t sensors = default_->sensors;
  std::array<float, kMaxSensors> raw{};
  std::array<float, kMaxSensors> value{};
  std::bitset<kMaxSensors> valid;
  for (std::size_t i = 0; i < std::min(sensors, packet.raw.size()); ++i) {
    raw[i] = packet.raw[i];
    value[i] = calibration_->curve[i].value_at(raw[i]);
    valid[i] = packet.valid[i];
  }
  const std::span<float> values = std::span(value).first(sensors);
  drop_what_is_no_number(values, valid);
  calibration_->remove_crosstalk(values, valid);
  compute(values, valid);
  drop_what_is_no_number(values, valid);

  Sample sample;
  sample.header.device_ns = packet.device_ns;
  sample.quality = packet.quality;
  SampleWriter writer(sample);
  for (std::size_t i = 0; i < sensors; ++i) writer.add(value[i], valid[i]);
  for (std::size_t i = 0; i < sensors; ++i) {
    writer.add(raw[i], i < packet.raw.size() && packet.valid[i]);
  }
  for (const float extra :
       packet.extra.first(std::min(packet.extra.size(), kMaxGloveValues - 2 * sensors))) {
    writer.add(extra, true);
  }
  writer.finish();
  sink.sample(sample);
  pose(values, valid, packet, sink);
}

RT_SAFE void GloveDecoder::pose(std::span<const float> value, const std::bitset<kMaxSensors>& valid,
                                const Packet& packet, Sink& sink) noexcept {
  if (skeleton_ == nullptr) return;
  HandAngles angles;
  calibration_->map_to_hand(value, valid, angles);
  // A broken or badly calibrated sensor invalidates only its own joint, not the whole hand.
  if (!drop_implausible(angles)) sink.outcome(Outcome::kOutOfRange);
  const auto mapped = std::span(calibration_->map).first(calibration_->map_rows);
  const bool any = std::ranges::any_of(
      mapped, [&](const MapRow& row) { return std::isfinite(angles[row.channel]); });
  if (!any) return;
  Frame frame;
  frame.header.device_ns = packet.device_ns;
  frame.quality = packet.quality;
  frame.source = Source::kDevice;
  set_hand_angles(*skeleton_, angles, frame);
  sink.frame(frame);
}

}  // namespace posed::drivers::glove
