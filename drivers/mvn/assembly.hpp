// Assembly: puts a sample together that MVN has split into several datagrams, in any order. Fixed
// size, RT-safe.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/mvn/protocol.hpp"

namespace posed::drivers::mvn {

class Assembly {
 public:
  using Buffer = std::array<std::byte, kMaxPoseBytes>;

  [[nodiscard]] bool is_open() const noexcept { return open_; }
  [[nodiscard]] std::uint32_t sample() const noexcept { return sample_; }

  void begin(std::uint32_t sample) noexcept {
    open_ = true;
    sample_ = sample;
    used_ = 0;
    parts_ = 0;
    came_.reset();
  }
  void close() noexcept { open_ = false; }

  // kDuplicate: the part came before. kOutOfRange: the parts contradict each other, or no character
  // has so many segments.
  [[nodiscard]] Outcome add(const Datagram& datagram) noexcept {
    const std::size_t part = datagram.head.part;
    const std::size_t bytes = datagram.payload.size();
    if (part >= kMaxItems || bytes > buffer_.size() - used_) return Outcome::kOutOfRange;
    if (came_[part]) return Outcome::kDuplicate;
    const bool beyond = parts_ != 0 && part >= parts_;
    if (beyond || (datagram.head.last && (came_ >> part).any())) return Outcome::kOutOfRange;
    came_.set(part);
    place_[part] = {used_, bytes};
    std::ranges::copy(datagram.payload, buffer_.begin() + static_cast<std::ptrdiff_t>(used_));
    used_ += bytes;
    if (datagram.head.last) parts_ = part + 1;
    return Outcome::kOk;
  }

  [[nodiscard]] bool is_whole() const noexcept { return parts_ != 0 && came_.count() == parts_; }

  // The payload of the whole sample, in `to`.
  [[nodiscard]] std::span<const std::byte> gather(Buffer& to) const noexcept {
    std::size_t size = 0;
    for (std::size_t part = 0; part < parts_; ++part) {
      const auto [offset, bytes] = place_[part];
      std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(offset), bytes,
                  to.begin() + static_cast<std::ptrdiff_t>(size));
      size += bytes;
    }
    return std::span(to).first(size);
  }

 private:
  struct Place {
    std::size_t offset = 0;
    std::size_t bytes = 0;
  };
  Buffer buffer_{};
  std::array<Place, kMaxItems> place_{};  // [part]
  std::bitset<kMaxItems> came_;           // [part]
  std::size_t used_ = 0;
  std::size_t parts_ = 0;  // 0 until the last one has come
  std::uint32_t sample_ = 0;
  bool open_ = false;
};

}  // namespace posed::drivers::mvn
