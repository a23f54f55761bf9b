// A lock-free ring of records {header, bytes} of any length, between one producer and one consumer.
// A record that does not fit is refused as a whole. The memory is touched at construction, so that
// the producer never causes a page fault.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>

#include "proto/frame/rt_safe.hpp"

namespace posed::record {

// Header: trivially copyable, with a member `bytes` that holds the length of all bytes behind it.
template <typename Header>
class RecordRing {
  static_assert(std::is_trivially_copyable_v<Header>);

 public:
  explicit RecordRing(std::size_t capacity_bytes) : ring_(capacity_bytes) {
    const std::vector<std::byte> zeros(capacity_bytes);
    ring_.push(zeros.data(), zeros.size());
    ring_.reset();
  }

  // How much of the capacity a record uses.
  [[nodiscard]] static std::size_t size_of(const Header& header) noexcept {
    return sizeof(Header) + header.bytes;
  }

  // Producer. The bytes behind the header are those of `first` and then those of `second`. Returns
  // false if the ring is full; then nothing was written.
  RT_SAFE [[nodiscard]] bool push(const Header& header, std::span<const std::byte> first,
                                  std::span<const std::byte> second = {}) noexcept {
    if (ring_.write_available() < size_of(header)) return false;
    std::array<std::byte, sizeof(Header)> image;
    std::memcpy(image.data(), &header, sizeof(Header));
    ring_.push(image.data(), image.size());
    ring_.push(first.data(), first.size());
    ring_.push(second.data(), second.size());
    return true;
  }

  // Consumer: calls each(header, bytes) for the records that are there now, not for later ones. The
  // bytes are valid during the call.
  template <typename Each>
  void drain(Each&& each) {
    std::size_t budget = ring_.read_available();
    while (budget >= sizeof(Header) || header_ready_) {
      if (!header_ready_) {
        std::array<std::byte, sizeof(Header)> image;
        ring_.pop(image.data(), image.size());
        std::memcpy(&header_, image.data(), sizeof(Header));
        header_ready_ = true;
        budget -= sizeof(Header);
      }
      // Header and bytes are several pushes: the later ones may still be missing.
      if (budget < header_.bytes) return;
      scratch_.resize(header_.bytes);
      ring_.pop(scratch_.data(), scratch_.size());
      budget -= header_.bytes;
      header_ready_ = false;
      each(std::as_const(header_), std::span<const std::byte>(scratch_));
    }
  }

 private:
  boost::lockfree::spsc_queue<std::byte> ring_;
  // Used by the consumer.
  Header header_{};
  bool header_ready_ = false;
  std::vector<std::byte> scratch_;
};

}  // namespace posed::record
