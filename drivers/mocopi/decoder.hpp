// Decodes each datagram of a mocopi app: a skeleton is passed on, a frame becomes one Frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/datagram_order.hpp"
#include "drivers/driver.hpp"
#include "drivers/mocopi/protocol.hpp"
#include "drivers/timestamp_clock.hpp"

namespace posed::drivers::mocopi {

// The one body of a mocopi app, compiled from the skeleton that it sends.

class MocopiLayout final : public SourceLayout {
 public:
  std::vector<std::uint16_t> id;  // [joint], depth first

  // The joint of a bone; id.size() when there is none.
  RT_SAFE [[nodiscard]] std::size_t joint_of(std::uint16_t bone) const noexcept;
};

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

class MocopiDecoder final : public LayoutDecoder<MocopiLayout> {
 public:
  // Takes one datagram per call.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  [[nodiscard]] Outcome accept_frame(std::span<const std::byte> content, Sink& sink) noexcept;

  DatagramOrder order_{32};
  TimestampClock clock_;
};

}  // namespace posed::drivers::mocopi
