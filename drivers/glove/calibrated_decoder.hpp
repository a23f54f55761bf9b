// CalibratedDecoder: the part of a glove's decoder that takes a user's calibration.
#pragma once

#include "drivers/driver.hpp"
#include "drivers/glove/calibration.hpp"

namespace posed::drivers::glove {

class CalibratedDecoder {
 public:
  CalibratedDecoder() = default;
  CalibratedDecoder(const CalibratedDecoder&) = delete;
  CalibratedDecoder& operator=(const CalibratedDecoder&) = delete;
  virtual ~CalibratedDecoder() = default;

  // Uses this calibration from the next packet on; the calibration must outlive its use. Until the
  // first call the device's default applies.
  RT_SAFE virtual void calibrate(const Calibration& calibration) noexcept = 0;
};

// The decoder of a glove; null for other devices. Cold: the reader uses Device::calibrated.
[[nodiscard]] inline CalibratedDecoder* calibrated_decoder(Decoder& decoder) {
  return dynamic_cast<CalibratedDecoder*>(&decoder);
}

}  // namespace posed::drivers::glove
