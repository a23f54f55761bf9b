// GloveDecoder: the part of a decoder that all gloves share. A device's own decoder splits the
// bytes into packets and passes raw values on; this class calibrates them, applies the device's own
// formula, poses the hand and emits a Sample and a Frame.
#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <span>

#include "drivers/glove/calibrated_decoder.hpp"
#include "drivers/glove/model.hpp"

namespace posed::drivers::glove {

// The content of one packet. Its spans are only used during the call.
struct Packet {
  std::span<const float> raw;      // [sensor of the Model]
  std::bitset<kMaxSensors> valid;  // sensors that the device has and reports as valid
  std::span<const float> extra;    // buttons, sticks, battery; unit 1
  std::int64_t device_ns = kNoTime_ns;
  Quality quality = Quality::kMeasured;  // kHeld: the same measurement as in the packet before
};

// Names and units of a glove's Sample: calibrated values, then raw_<sensor>, then the extras.
[[nodiscard]] SampleLayout sample_layout(const Model& model,
                                         std::span<const std::string> extras = {});

class GloveDecoder : public Decoder, public CalibratedDecoder {
 public:
  // A calibration with a different number of sensors is ignored; another one outlives its use.
  RT_SAFE void calibrate(const Calibration& calibration) noexcept override {
    if (calibration.sensors == default_->sensors) calibration_ = &calibration;
  }

 protected:
  // `skeleton` is a hand45 skeleton; null for a glove without a pose.
  GloveDecoder(std::shared_ptr<const Skeleton> skeleton,
               std::shared_ptr<const Calibration> default_calibration);

  // Emits the Sample, then the Frame (no Frame when no channel of the map is known). A value that
  // is not finite or too large is marked as not valid and is zero in the Sample.
  RT_SAFE void emit(const Packet& packet, Sink& sink) noexcept;

  // Applies the device's formula to calibrated values, in place (relative abductions, computed
  // joints); may make values valid.
  RT_SAFE virtual void compute(std::span<float> value,
                               std::bitset<kMaxSensors>& valid) const noexcept;

  [[nodiscard]] const Calibration& calibration() const noexcept { return *calibration_; }

 private:
  void pose(std::span<const float> value, const std::bitset<kMaxSensors>& valid,
            const Packet& packet, Sink& sink) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  std::shared_ptr<const Calibration> default_;
  const Calibration* calibration_;
};

}  // namespace posed::drivers::glove
