// Turns the clock ticks of a stream without a device into frames, to be filled with synthesised
// poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Device time follows the ticks: frame n is at n / rate. The pose is that of rest, held.
class LabelsDecoder final : public Decoder {
 public:
  static constexpr std::string_view kBeat = "\n";

  // `rest` is posed for the stream's skeleton; its header does not matter.
  LabelsDecoder(const Frame& rest, double rate_hz);

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  Frame rest_;
  double rate_hz_;
  std::int64_t beats_ = 0;
  bool foreign_ = false;  // inside foreign bytes, which are already counted
};

}  // namespace posed::drivers
