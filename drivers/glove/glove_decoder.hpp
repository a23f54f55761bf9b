// GloveDecoder: the half of a decoder that all gloves share. A device's own decoder frames the
// bytes and hands over raw values; this calibrates them, lets the device compute what it computes
// from them, poses the hand and emits a Sample and a Frame.
#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <span>

#include "drivers/driver.hpp"
#include "drivers/glove/calibration.hpp"

namespace posed::drivers::glove {

// One packet. Spans are read at once.
struct Packet {
  std::span<const float> raw;      // [sensor of the Model]
  std::bitset<kMaxSensors> valid;  // sensors the device has and believes
  std::span<const float> extra;    // buttons, sticks, battery; unit 1
  std::int64_t device_ns = kNoTime_ns;
  Quality quality = Quality::kMeasured;  // kHeld: the same measurement as in the packet before
};

// Names and units of a glove's Sample: calibrated values, then raw_<sensor>, then the extras.
[[nodiscard]] SampleLayout sample_layout(const Model& model,
                                         std::span<const std::string> extras = {});

class GloveDecoder : public Decoder {
 public:
  // A calibration for another number of sensors than the glove has is not used. RT-safe.
  void calibrate(const Calibration& calibration) noexcept override {
    if (calibration.sensors == default_->sensors) calibration_ = &calibration;
  }

 protected:
  // `skeleton` is a hand45 skeleton; null for a glove that poses nothing.
  GloveDecoder(std::shared_ptr<const Skeleton> skeleton,
               std::shared_ptr<const Calibration> default_calibration);

  // Emits the Sample, then the Frame (no Frame when no channel of the map is known). What is not a
  // number of a sensible size is not valid, and zero in the Sample. RT-safe.
  void emit(const Packet& packet, Sink& sink) noexcept;

  // The device's formula on calibrated values, in place (relative abductions, computed joints); may
  // make values valid. RT-safe.
  virtual void compute(std::span<float> value, std::bitset<kMaxSensors>& valid) const noexcept;

  [[nodiscard]] const Calibration& calibration() const noexcept { return *calibration_; }

 private:
  void pose(std::span<const float> value, const std::bitset<kMaxSensors>& valid,
            const Packet& packet, Sink& sink) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  std::shared_ptr<const Calibration> default_;
  const Calibration* calibration_;
};

}  // namespace posed::drivers::glove
