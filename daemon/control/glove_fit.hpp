// What a FitGlove request asks for: a glove's calibration from the poses that a client saw held, as
// `posed calibrate` makes it. Any thread; cold.
#pragma once

#include <string>

#include "drivers/driver.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"

namespace posed::control {

struct FittedGlove {
  v1::GloveFit words{};
  std::string toml{};  // the calibration file; empty: the poses were only judged
};

// With contacts alone the calibration in use (the text; empty: the device's default) stays as it
// is, but for the thumb. Errors are sentences for the client: the device is no glove, there is no
// flat hand among the poses, or (with a name) a pose is to be held again.
Result<FittedGlove> fit_glove(const drivers::Description& device, const std::string& in_use,
                              const v1::ControlRequest::FitGlove& wanted);

}  // namespace posed::control
