// Decodes the messages of one stream of an upstream: a skeleton is passed on, a pose becomes one
// Frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/chain/protocol.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/timestamp_clock.hpp"

namespace posed::drivers::chain {

// The one body of an upstream's stream, compiled from its skeleton message.

class UpstreamLayout final : public SourceLayout {
 public:
  // Skeleton::id at the upstream. It differs from that of the skeleton made here, because a message
  // carries less (proto/message/skeleton_message.hpp).
  std::uint32_t upstream_id = 0;
};

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

class UpstreamDecoder final : public LayoutDecoder<UpstreamLayout> {
 public:
  explicit UpstreamDecoder(const std::string& stream)
      : stream_(stream), pose_topic_("pose/" + stream), skeleton_topic_("skeleton/" + stream) {}

  // Takes one message per call.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  [[nodiscard]] Outcome accept(std::span<const std::byte> bytes, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_pose(std::span<const std::byte> body, Sink& sink) noexcept;

  std::string stream_, pose_topic_, skeleton_topic_;
  DatagramOrder order_{64};
  TimestampClock clock_;
  UpstreamFrame upstream_;
};

}  // namespace posed::drivers::chain
