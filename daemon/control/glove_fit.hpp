// Answers a FitGlove request: judges the poses that a client saw held, and calibrates the glove by
// them as `posed calibrate` does. Any thread; cold.
#pragma once

#include <string>

#include "drivers/driver.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"

namespace posed::control {

struct FittedGlove {
  v1::GloveFit words{};  // for the client
  std::string toml{};    // the calibration file; empty: the poses were only judged
};

// Without a name the poses are only judged. If all of them are contacts, the calibration `in_use`
// (its text; empty: none, an error) stays as it is but for the thumb. Errors are sentences for the
// client: the device is no glove, there is no flat hand among the poses, or (with a name) a pose is
// to be held again.
Result<FittedGlove> fit_glove(const drivers::Description& device, const std::string& in_use,
                              const v1::ControlRequest::FitGlove& wanted);

}  // namespace posed::control
