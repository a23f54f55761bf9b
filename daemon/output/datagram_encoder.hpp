// DatagramEncoder: people in the form of one protocol whose program only sends, in datagrams.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/inbox.hpp"
#include "proto/frame/device_time.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::output {

using SendDatagram = std::function<void(std::span<const std::byte>)>;

// One thread.
class DatagramEncoder {
 public:
  DatagramEncoder() = default;
  DatagramEncoder(const DatagramEncoder&) = delete;
  DatagramEncoder& operator=(const DatagramEncoder&) = delete;
  virtual ~DatagramEncoder() = default;

  // The person of a place comes, or is another one; null: has left. An error says why the person
  // cannot be sent; then the place is empty. Cold.
  [[nodiscard]] virtual Result<> set_person(std::size_t place, const LiveStream* stream) = 0;
  // What else is known of the person; before its frame, or without one.
  virtual void take_sample(std::size_t /*place*/, const Sample& /*sample*/) {}
  // Returns false, and does nothing, for an empty place.
  [[nodiscard]] virtual bool take(std::size_t place, const Frame& frame) = 0;

  // Sends what the program tells about its people from time to time.
  virtual void describe(const SendDatagram& send) = 0;
  [[nodiscard]] virtual std::int64_t describe_every_ns() const noexcept = 0;
  // Sends the poses that have been taken.
  virtual void encode(const SendDatagram& send) = 0;
};

// When the pose was measured, in host time as well as posed knows it.
[[nodiscard]] inline std::int64_t measured_ns(const Header& header) noexcept {
  const bool mapped = header.device_ns != kNoTime_ns && header.clock.valid;
  return mapped ? to_host_ns(header.clock, header.device_ns) : header.arrival_ns;
}

// Brings the time of what is sent up to a frame's. It never goes back: people come with different
// delays, a silent one's last pose is repeated, and a device's clock is known only after a while.
inline void advance(std::int64_t& time_ns, const Header& header) noexcept {
  time_ns = std::max(time_ns, measured_ns(header));
}

// The encoders of the kinds.
[[nodiscard]] std::unique_ptr<DatagramEncoder> mvn_encoder(const config::OutputConfig& config);
[[nodiscard]] std::unique_ptr<DatagramEncoder> mocopi_encoder();
[[nodiscard]] std::unique_ptr<DatagramEncoder> rokoko_encoder(const config::OutputConfig& config);

}  // namespace posed::output
