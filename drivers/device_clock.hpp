// DeviceClock maps a device's own time to the host's clock. A packet never arrives before it was
// sent: the difference between its arrival and its device time is the offset of the two clocks,
// plus their drift, plus a delay that is sometimes small (USB delivers in batches) but never
// negative. The mapping is therefore the closest line below all points (device time, arrival -
// device time): the edge of their lower convex hull that lies below their mean (Moon, Skelly,
// Towsley 1999, "Estimation and removal of clock skew from network delay measurements").
//
// Pure: the same packets give the same mapping, live and in replay. RT-safe throughout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "proto/frame/frame.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {

class DeviceClock {
 public:
  // Adds one packet and returns the new mapping. A packet without device time (kNoTime_ns) changes
  // nothing. If the device's time jumps (the device restarted), the estimate starts again.
  ClockMapping observe(std::int64_t device_ns, std::int64_t arrival_ns) noexcept;

  // Adds the frame as a packet and writes the mapping to its header. Does nothing for a frame that
  // has no device time stamp.
  void stamp(Frame& frame) noexcept {
    if (frame.source != Source::kDevice) return;
    frame.header.clock = observe(frame.header.device_ns, frame.header.arrival_ns);
  }

  // A new link to the device was opened: forgets what the old link showed.
  void restart() noexcept;

  // How often the device's time has jumped, over all links.
  [[nodiscard]] std::uint64_t jumps() const noexcept { return jumps_; }
  [[nodiscard]] const ClockMapping& mapping() const noexcept { return mapping_; }

 private:
  // The smallest delay within half a second.
  struct Point {
    std::int64_t device_ns;
    std::int64_t delay_ns;  // arrival - device
  };
  // half a minute; over a longer time a crystal warms up and drifts differently
  static constexpr std::size_t kPoints = 64;

  [[nodiscard]] bool jumped(std::int64_t device_ns, std::int64_t delay_ns) noexcept;
  void close_point() noexcept;
  void fit() noexcept;

  std::array<Point, kPoints> points_{};  // a ring; the oldest is at `first_`
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Point open_{};  // of the current half second
  std::int64_t open_until_ns_ = kNoTime_ns;
  std::int64_t late_since_ns_ = kNoTime_ns;
  ClockMapping mapping_;
  std::uint64_t jumps_ = 0;
};

}  // namespace posed::drivers
