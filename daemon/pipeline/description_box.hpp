// DescriptionBox passes what a device says about its bodies from the reader to the cold thread that
// builds skeletons and stages from it. Only the newest description counts: one that was not
// received in time is replaced. Most devices repeat their description; a repetition is ignored.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/sink.hpp"

namespace posed::pipeline {

// One producer, one consumer. Three buffers: one to write, one to read, and the newest between
// them.
class DescriptionBox {
 public:
  // `wake` is notified when there is something to receive; it outlives the box.
  explicit DescriptionBox(system::EventFd& wake) : wake_(wake) {
    for (Buffer& buffer : buffers_) buffer.bytes = std::make_unique<std::byte[]>(kMaxDescription);
  }

  // Producer. Longer ones than kMaxDescription are ignored. RT-safe but for the wake-up.
  void put(std::span<const std::byte> bytes) noexcept {
    if (bytes.size() > kMaxDescription || repeats(bytes)) return;
    Buffer& buffer = buffers_[writing_];
    std::ranges::copy(bytes, buffer.bytes.get());
    buffer.size = bytes.size();
    last_ = writing_;
    const std::uint8_t before =
        newest_.exchange(static_cast<std::uint8_t>(writing_ | kNew), std::memory_order_acq_rel);
    if ((before & kNew) != 0) count(replaced_);
    writing_ = before & kIndex;
    wake_.notify();
  }

  // How many descriptions were replaced before they were received. Any thread.
  [[nodiscard]] std::uint64_t replaced() const noexcept { return replaced_.load(); }

  // Consumer. Whether receive() would return a description.
  [[nodiscard]] bool has_new() const noexcept {
    return (newest_.load(std::memory_order_acquire) & kNew) != 0;
  }

  // Consumer. The newest description; false when there is none since the last call.
  [[nodiscard]] bool receive(std::vector<std::byte>& bytes) {
    if (!has_new()) return false;
    reading_ = newest_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    const Buffer& buffer = buffers_[reading_];
    bytes.assign(buffer.bytes.get(), buffer.bytes.get() + buffer.size);
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kNew = 4;  // was not received yet
  struct Buffer {
    std::unique_ptr<std::byte[]> bytes;
    std::size_t size = 0;
  };

  // The buffer that was written last is not written again before the next one is; the consumer only
  // reads it.
  [[nodiscard]] bool repeats(std::span<const std::byte> bytes) const noexcept {
    const Buffer& last = buffers_[last_];
    return last.size == bytes.size() &&
           std::ranges::equal(bytes, std::span(last.bytes.get(), last.size));
  }

  system::EventFd& wake_;
  std::array<Buffer, 3> buffers_;
  std::uint8_t writing_ = 0;
  std::uint8_t last_ = 1;  // written last
  std::uint8_t reading_ = 1;
  std::atomic<std::uint8_t> newest_{2};
  std::atomic<std::uint64_t> replaced_{0};
};

}  // namespace posed::pipeline
