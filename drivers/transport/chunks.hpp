// Chunks: raw pieces of input, one after the other in one block; FileTransport plays them.
#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers {

class Chunks {
 public:
  // Cold: copies.
  void add(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    ends_.push_back(bytes_.size());
  }
  void add(std::string_view text) { add(std::as_bytes(std::span(text))); }

  [[nodiscard]] std::size_t count() const noexcept { return ends_.size(); }

  // Valid until the next add().
  RT_SAFE [[nodiscard]] std::span<const std::byte> operator[](std::size_t index) const noexcept {
    assert(index < ends_.size());
    const std::size_t begin = index == 0 ? 0 : ends_[index - 1];
    return {bytes_.data() + begin, ends_[index] - begin};
  }

 private:
  std::vector<std::byte> bytes_;
  std::vector<std::size_t> ends_;  // [chunk], index of the first byte after it
};

}  // namespace posed::drivers
