// EmulatedGlove: an emulator brought to life: a hand's motion, a port, and the host's clock between
// them. `posed emulate` runs one to its end, the demo one on a thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "daemon/emulate/emulated_port.hpp"
#include "drivers/emulate/faults.hpp"
#include "drivers/emulator.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

// The pose of a recorded hand, between its frames and round and round; missing values are zero.
[[nodiscard]] HandAngles pose_at(const clip::HandClip& clip, double time_s);

class EmulatedGlove {
 public:
  using Bytes = drivers::Emulator::Bytes;
  struct Settings {
    double speed = 1.0;                                     // times the device's own pace
    std::vector<drivers::emulate::FaultInjector> faults{};  // of the line, one after the other
  };

  // `motion` gives the hand's pose at a time since the start; empty leaves the pose alone.
  EmulatedGlove(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                std::function<HandAngles(double time_s)> motion, Settings settings);

  [[nodiscard]] const std::string& port() const noexcept { return port_.name(); }

  // Until a stop is asked for, or the host has hung up for good. Blocks.
  void run(const std::stop_token& stop);

  [[nodiscard]] std::uint64_t packets() const noexcept { return packets_.load(); }

 private:
  void emit(std::int64_t device_ns);

  std::unique_ptr<drivers::Emulator> emulator_;
  EmulatedPort port_;
  std::function<HandAngles(double time_s)> motion_;
  Settings settings_;
  Bytes packet_, passed_;
  std::atomic<std::uint64_t> packets_{0};
};

}  // namespace posed::emulate
