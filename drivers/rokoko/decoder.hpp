// Decodes each datagram of Rokoko Studio: one frame for each body that the layout names, a sample
// for each face. Bodies that come, go or change are described before their frames.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/rokoko/description.hpp"
#include "drivers/rokoko/roster.hpp"
#include "drivers/rokoko/studio_frame.hpp"
#include "drivers/timestamp_clock.hpp"

namespace posed::drivers::rokoko {

// The bodies of a Studio stream, compiled from the decoder's description.

// Says from which joints of the stream a skeleton is made.
struct BodyPlan {
  BodyKey key;
  std::vector<std::uint8_t> joint;  // [joint of the skeleton] joint of joints.hpp
  bool face = false;
};

class StudioLayout final : public SourceLayout {
 public:
  std::vector<BodyPlan> plans;  // [body]

  // The index of a body; bodies.size() when there is no such body.
  RT_SAFE [[nodiscard]] std::size_t body_of(const BodyKey& key) const noexcept;
};

// The skeleton of a body as it was described; null for one with only a face. Cold.
Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                    const std::string& name);

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

class StudioDecoder final : public LayoutDecoder<StudioLayout> {
 public:
  // Takes one datagram per call.
  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  static constexpr std::size_t kMaxJson = 256 * 1024;  // bytes that a datagram may unpack to

  [[nodiscard]] Outcome read(std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] Outcome accept_frame(std::int64_t received_ns, Sink& sink) noexcept;
  // Emits one body if it fits the layout.
  [[nodiscard]] Outcome emit(const SeenBody& seen, Sink& sink) noexcept;
  void emit_face(std::size_t body, const Subject& subject, Sink& sink) noexcept;

  ActiveTime active_time_;
  TimestampClock clock_;
  StudioFrame frame_;
  Roster roster_;
  bool told_named_joints_ = false;
  std::bitset<kMaxBodies> taken_;  // bodies of the frame so far
  std::array<std::byte, kMaxJson> json_{};
};

}  // namespace posed::drivers::rokoko
