// Decodes MVN's datagrams, over UDP or out of a TCP stream: each sample of a character becomes one
// Frame. The decoder also keeps the list of the characters that it receives, and describes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/mvn/framer.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"
#include "drivers/mvn/tracked.hpp"

namespace posed::drivers::mvn {

class MvnDecoder final : public LayoutDecoder<MvnLayout> {
 public:
  // `stream`: the bytes come over TCP, cut anywhere; otherwise each call gets one datagram.
  explicit MvnDecoder(bool stream) noexcept : stream_(stream) {}

  RT_SAFE void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                    Sink& sink) noexcept override;

 private:
  [[nodiscard]] Outcome accept(std::span<const std::byte> bytes, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_pose(const Datagram& datagram, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_sample(Tracked& tracked, const Head& head,
                                      std::span<const std::byte> items, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_values(const Datagram& datagram, Sink& sink) noexcept;
  [[nodiscard]] Outcome accept_timecode(const Datagram& datagram) noexcept;
  [[nodiscard]] Outcome accept_meta(const Datagram& datagram) noexcept;
  [[nodiscard]] Outcome accept_scale(const Datagram& datagram) noexcept;
  [[nodiscard]] Tracked* find(std::uint8_t character) noexcept;
  // The character, now known if there is room; null otherwise.
  [[nodiscard]] Tracked* find_or_add(std::uint8_t character) noexcept;
  [[nodiscard]] std::int64_t device_time_ns(Tracked& tracked, const Head& head) noexcept;
  void describe(Sink& sink) noexcept;

  bool stream_;
  ActiveTime active_time_;            // MVN may pause: that makes nobody leave
  std::int64_t now_ns_ = kNoTime_ns;  // arrival of the bytes, in that time
  std::int64_t arrival_ns_ = kNoTime_ns;
  std::int64_t described_ns_ = kNoTime_ns;
  std::array<Tracked, kMaxCharacters> characters_;
  Timecode timecode_{};  // the newest, of this sample:
  std::uint32_t timecode_sample_ = 0;
  CharacterPose pose_;
  GroupValues values_;
  Assembly::Buffer gathered_{};
  std::array<std::byte, kMaxMvnDescription> description_{};
  Framer framer_;
};

}  // namespace posed::drivers::mvn
