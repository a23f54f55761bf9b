// Converts samples to the wire format (proto/wire/posed/v1/posed.proto). The message is reused, so
// encoding a sample allocates nothing.
#pragma once

#include <string>

#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/frame.hpp"

namespace posed::publish {

class SampleEncoder {
 public:
  SampleEncoder(const std::string& stream, const drivers::SampleLayout& layout);
  [[nodiscard]] const v1::Sample& encode(const Sample& sample);

 private:
  v1::Sample message_;
};

}  // namespace posed::publish
