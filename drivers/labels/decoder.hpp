// The beat of a stream without a device, to frames: each one is a place for a performed pose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Device time is the beat's: frame n is at n / rate. The pose is the hand at rest, held.
class LabelsDecoder final : public Decoder {
 public:
  static constexpr std::string_view kBeat = "\n";

  LabelsDecoder(std::shared_ptr<const Skeleton> skeleton, double rate_hz);

  // RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  double rate_hz_;
  std::int64_t beats_ = 0;
  bool foreign_ = false;  // in bytes that are no beat, which are already counted
};

}  // namespace posed::drivers
