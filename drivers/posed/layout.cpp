#include "drivers/posed/layout.hpp"

#include "drivers/posed/protocol.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/message/skeleton_message.hpp"

namespace posed::drivers::chain {

Result<std::unique_ptr<const SourceLayout>> make_layout(std::span<const std::byte> description) {
  v1::Skeleton message;
  if (!message.ParseFromArray(description.data(), static_cast<int>(description.size()))) {
    return fail("the upstream's skeleton is damaged; is it a posed of another version?");
  }
  if (!is_upstream_stream(message.stream())) {
    return fail("the upstream's skeleton names no stream; is it a posed of another version?");
  }
  auto skeleton = message::skeleton_from(message);
  if (!skeleton) return std::unexpected(skeleton.error());
  auto layout = std::make_unique<UpstreamLayout>();
  layout->upstream_id = message.id();
  const double rate_hz = message.rate_hz();
  layout->bodies.push_back({.name = message.stream(),
                            .skeleton = std::move(*skeleton),
                            .rate_hz = rate_hz > 0.0 && rate_hz <= 1000.0 ? rate_hz : 0.0});
  return layout;
}

}  // namespace posed::drivers::chain
