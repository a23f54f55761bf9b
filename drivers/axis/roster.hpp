// Roster: the avatars that are in a stream now, with their proportions as they were described. It
// says when they have changed enough to be described again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/axis/description.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/unrolled_counter.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers::axis {

// One avatar in the stream.
struct Present {
  AvatarEntry entry;
  DatagramOrder order{32};
  UnrolledCounter counter{32};
  // The stream's frames before the newest message, by its frame number: one clock for all avatars,
  // also for those that come later or return.
  std::int64_t tick = 0;
  std::int64_t first_tick = 0;  // when the avatar appeared
  bool used = false;

  std::int64_t seen_ns = 0;              // when its last message arrived
  std::int64_t differs_ns = kNoTime_ns;  // since when its proportions have been others
};

class Roster {
 public:
  // `order` of the rotations, an index of kOrderNames; `figure` that the options say.
  Roster(std::uint8_t order, std::optional<Figure> figure) noexcept
      : order_(order), figure_(figure) {}

  // The place of an avatar, a new one if needed; null when all are taken.
  RT_SAFE [[nodiscard]] Present* find(const Avatar& avatar) noexcept;

  // Stores a valid message of it.
  RT_SAFE void see(Present& present, const Message& message, std::int64_t now_ns) noexcept;

  // Forgets avatars that are gone. Returns the list of the others if it is not as described before,
  // at most twice a second, otherwise nothing.
  RT_SAFE [[nodiscard]] std::span<const std::byte> news(std::int64_t now_ns) noexcept;

 private:
  void count_frames(Present& present, std::uint32_t frame_number) noexcept;
  void measure(Present& present, const Message& message, std::int64_t now_ns) noexcept;
  void forget_gone(std::int64_t now_ns) noexcept;

  std::uint8_t order_;
  std::optional<Figure> figure_;
  std::array<Present, kMaxBodies> all_;
  std::int64_t newest_tick_ = 0;  // of all avatars
  bool changed_ = false;
  bool described_ = false;         // at least once
  std::int64_t described_ns_ = 0;  // when
  std::int64_t received_ns_ = 0;   // when the last message of any avatar arrived
  std::array<std::byte, kListHeadBytes + kMaxBodies * kMaxEntryBytes> list_{};
};

}  // namespace posed::drivers::axis
