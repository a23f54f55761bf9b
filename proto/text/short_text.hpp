// ShortText: text with a fixed capacity, shown to users, so that it can travel through a ring by
// value.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace posed {

// Longer text is cut. RT-safe.
class ShortText {
 public:
  ShortText() = default;
  explicit ShortText(std::string_view text) noexcept { add(text); }

  void add(std::string_view text) noexcept {
    std::size_t fits = std::min(text.size(), bytes_.size() - size_);
    cut_ = cut_ || fits < text.size();
    // never split a UTF-8 character
    while (fits > 0 && fits < text.size() && (text[fits] & 0xc0) == 0x80) --fits;
    std::copy_n(text.begin(), fits, bytes_.begin() + size_);
    size_ = static_cast<std::uint8_t>(size_ + fits);
  }
  [[nodiscard]] std::string_view text() const noexcept { return {bytes_.data(), size_}; }
  [[nodiscard]] bool cut() const noexcept { return cut_; }  // the text was longer

 private:
  std::array<char, 94> bytes_{};
  std::uint8_t size_ = 0;
  bool cut_ = false;
};

}  // namespace posed
