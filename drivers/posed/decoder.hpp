// Decodes the messages of one stream of an upstream: a skeleton is passed on, a pose becomes one
// Frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/posed/layout.hpp"
#include "drivers/posed/protocol.hpp"
#include "drivers/timestamp_clock.hpp"

namespace posed::drivers::chain {

class UpstreamDecoder final : public Decoder {
 public:
  explicit UpstreamDecoder(const std::string& stream)
      : stream_(stream), pose_topic_("pose/" + stream), skeleton_topic_("skeleton/" + stream) {}

  // Takes one message per call. RT-safe.
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override;

  // Takes what make_layout made. RT-safe.
  void use(const SourceLayout& layout) noexcept override {
    layout_ = static_cast<const UpstreamLayout*>(&layout);
  }

 private:
  [[nodiscard]] Outcome accept(std::span<const std::byte> bytes, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_pose(std::span<const std::byte> body, Sink& sink) noexcept;

  std::string stream_, pose_topic_, skeleton_topic_;
  const UpstreamLayout* layout_ = nullptr;  // null until the upstream has sent a skeleton
  DatagramOrder order_{64};
  TimestampClock clock_;
  UpstreamFrame upstream_;
};

}  // namespace posed::drivers::chain
