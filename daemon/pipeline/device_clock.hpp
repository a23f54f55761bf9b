// DeviceClock: where a device's own time stands on the host's clock. A packet is never early: what
// lies between its device time and its arrival is the clocks' offset, their drift, and a delay that
// is sometimes small (USB hands over in batches) and never negative. So the mapping is the line
// under all points (device time, arrival - device time) that lies closest to them: the edge of
// their lower convex hull below their mean (Moon, Skelly, Towsley 1999, "Estimation and removal of
// clock skew from network delay measurements").
//
// Pure: the same packets give the same mapping, live and in replay. RT-safe throughout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "proto/frame/frame.hpp"
#include "proto/frame/time.hpp"

namespace posed::pipeline {

class DeviceClock {
 public:
  // The mapping with this packet taken in. Device times without one (kNoTime_ns) change nothing.
  // One that jumps (the device restarted) begins anew.
  ClockMapping take(std::int64_t device_ns, std::int64_t arrival_ns) noexcept;

  // The same for a frame, whose header gets the mapping; one that no device stamped is left alone.
  void stamp(Frame& frame) noexcept {
    if (frame.source != Source::kDevice) return;
    frame.header.clock = take(frame.header.device_ns, frame.header.arrival_ns);
  }

  // The link is new: what is known of the old one no longer holds.
  void restart() noexcept;

  // Times that the device's time jumped, over all links.
  [[nodiscard]] std::uint64_t jumps() const noexcept { return jumps_; }
  [[nodiscard]] const ClockMapping& mapping() const noexcept { return mapping_; }

 private:
  // The least delay of half a second.
  struct Point {
    std::int64_t device_ns;
    std::int64_t delay_ns;  // arrival - device
  };
  static constexpr std::size_t kPoints = 64;  // half a minute: longer, and a crystal warms up

  [[nodiscard]] bool jumped(std::int64_t device_ns, std::int64_t delay_ns) noexcept;
  void close_point() noexcept;
  void fit() noexcept;

  std::array<Point, kPoints> points_{};  // oldest first from `first_`
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Point open_{};  // of the half second under way
  std::int64_t open_until_ns_ = kNoTime_ns;
  std::int64_t late_since_ns_ = kNoTime_ns;
  ClockMapping mapping_;
  std::uint64_t jumps_ = 0;
};

// Host time of a device time.
[[nodiscard]] constexpr std::int64_t to_host_ns(const ClockMapping& clock,
                                                std::int64_t device_ns) noexcept {
  const double since_ns = static_cast<double>(device_ns - clock.origin_ns);
  return device_ns + clock.offset_ns +
         static_cast<std::int64_t>(static_cast<double>(clock.drift_ppm) * 1e-6 * since_ns);
}

}  // namespace posed::pipeline
