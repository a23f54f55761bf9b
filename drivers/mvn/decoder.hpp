// Decodes MVN's datagrams, over UDP or out of a TCP stream: each sample of a character becomes one
// Frame. The decoder also keeps the list of the characters that it receives, and describes it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/active_time.hpp"
#include "drivers/driver.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/mvn/protocol.hpp"
#include "drivers/mvn/tracked.hpp"

namespace posed::drivers::mvn {

// Finds MVN's datagrams in the byte stream of a TCP connection. The head tells how long the payload
// is. After damage it goes on at the next head.
class Framer {
 public:
  // The longest payload over TCP. The longest that is known describes 123 points of a character
  // (type 13) and has about 5 KB.
  static constexpr std::size_t kMaxPayload = std::size_t{16} * 1024;

  // Reads bytes cut at any position. `handle` gets each datagram, and empty bytes once for each run
  // of bytes that are none.
  template <typename Handle>
  RT_SAFE void feed(std::span<const std::byte> bytes, Handle&& handle) noexcept {
    while (!bytes.empty()) {
      const std::size_t used = std::min(bytes.size(), buffer_.size() - size_);
      std::ranges::copy(bytes.first(used), buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
      size_ += used;
      bytes = bytes.subspan(used);
      split(handle);
    }
  }

 private:
  // Takes all whole datagrams out of the buffer. Afterwards it has room: what is left is shorter
  // than one datagram.
  template <typename Handle>
  void split(Handle& handle) noexcept {
    std::size_t at = 0;
    while (at < size_) {
      const std::span<const std::byte> rest = std::span(buffer_).subspan(at, size_ - at);
      const Next next = look(rest);
      if (next.skip > 0) {
        if (!skipping_) handle(std::span<const std::byte>{});
        skipping_ = true;
        at += next.skip;
        continue;
      }
      if (next.whole == 0) break;
      skipping_ = false;
      handle(rest.first(next.whole));
      at += next.whole;
    }
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(at),
              buffer_.begin() + static_cast<std::ptrdiff_t>(size_), buffer_.begin());
    size_ -= at;
  }

  struct Next {
    std::size_t skip = 0;   // bytes that begin no datagram
    std::size_t whole = 0;  // bytes of the datagram at the start; both 0: more must come
  };
  [[nodiscard]] static Next look(std::span<const std::byte> bytes) noexcept;

  std::array<std::byte, kHeadBytes + kMaxPayload> buffer_{};
  std::size_t size_ = 0;
  bool skipping_ = false;
};

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
