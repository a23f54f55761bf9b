// EmulatedDevice runs an emulator: it connects a motion, a port and the host's clock. `posed
// emulate` runs one until it ends, the demo runs one on a thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "daemon/tools/emulate/emulated_port.hpp"
#include "drivers/emulate/faults.hpp"
#include "drivers/emulator.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::emulate {

// The pose of a recorded hand, interpolated between frames and repeated in a loop; missing values
// are zero.
[[nodiscard]] HandAngles pose_at(const clip::HandClip& clip, double time_s);

// Poses the emulator's bodies for a time since the start; empty: they move by themselves, or not.
using Motion = std::function<void(double time_s, drivers::Emulator& emulator)>;

// The motion of a glove whose hand has these angles.
[[nodiscard]] Motion hand_motion(std::function<HandAngles(double time_s)> angles_at);

class EmulatedDevice {
 public:
  using Bytes = drivers::Emulator::Bytes;
  struct Settings {
    double speed = 1.0;  // relative to the device's own rate
    // of the line, applied one after the other
    std::vector<drivers::emulate::FaultInjector> faults{};
  };

  EmulatedDevice(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port, Motion motion,
                 Settings settings);

  [[nodiscard]] const std::string& port() const noexcept { return port_.name(); }

  // Runs until a stop is requested or the host has closed the connection for good. Blocks.
  void run(const std::stop_token& stop);

  [[nodiscard]] std::uint64_t packets() const noexcept { return packets_.load(); }

 private:
  void emit(std::int64_t device_ns);

  std::unique_ptr<drivers::Emulator> emulator_;
  EmulatedPort port_;
  Motion motion_;
  Settings settings_;
  Bytes packet_, passed_;
  std::atomic<std::uint64_t> packets_{0};
};

}  // namespace posed::emulate
