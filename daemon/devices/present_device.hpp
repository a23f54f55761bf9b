// PresentDevice: which device a stream has now, and which calibration is in use. Control checks
// calibrations against it, stats report it, the supervisor changes it. Cold; any thread.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "drivers/driver.hpp"

namespace posed::devices {

class PresentDevice {
 public:
  void connected(drivers::Description description) { set(std::move(description), false); }

  // The device is unplugged. The description of what the stream was opened for stays, but the
  // identity is cleared, because another device may come.
  void gone() {
    drivers::Description description = *this->description();
    description.identity.clear();
    set(std::move(description), true);
  }

  // Whether the device is known to be absent, so that nothing can be sent to it.
  [[nodiscard]] bool away() const {
    const std::scoped_lock lock(mutex_);
    return away_;
  }

  // Never null. The identity is empty while no device is connected.
  [[nodiscard]] std::shared_ptr<const drivers::Description> description() const {
    const std::scoped_lock lock(mutex_);
    return description_;
  }

  // The text of the calibration in use, and its name for errors. The text is empty for the device's
  // default.
  struct CalibrationText {
    std::string toml, file;
  };
  void calibrated(CalibrationText text) {
    const std::scoped_lock lock(mutex_);
    calibration_ = std::move(text);
  }
  [[nodiscard]] CalibrationText calibration() const {
    const std::scoped_lock lock(mutex_);
    return calibration_;
  }

 private:
  void set(drivers::Description description, bool away) {
    auto now = std::make_shared<const drivers::Description>(std::move(description));
    const std::scoped_lock lock(mutex_);
    description_ = std::move(now);
    away_ = away;
  }

  mutable std::mutex mutex_;
  std::shared_ptr<const drivers::Description> description_ =
      std::make_shared<const drivers::Description>();
  CalibrationText calibration_;
  bool away_ = false;
};

}  // namespace posed::devices
