// LineReader: splits a byte stream into lines of text, for gloves that write one line a
// measurement.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>
#include <string_view>

#include "proto/frame/rt_safe.hpp"

namespace posed::drivers::glove {

// A line has at most `max` bytes before its line feed.
template <std::size_t max>
class LineReader {
 public:
  // Reads bytes cut at any position. Calls line(text) for each whole line, without its line end;
  // empty lines are left out. Calls overlong() once for a line longer than `max`, whose rest is
  // then dropped.
  template <typename Line, typename Overlong>
  RT_SAFE void feed(std::span<const std::byte> bytes, const Line& line,
                    const Overlong& overlong) noexcept {
    while (!bytes.empty()) {
      const void* const feed = std::memchr(bytes.data(), '\n', bytes.size());
      const std::size_t size =
          feed == nullptr
              ? bytes.size()
              : static_cast<std::size_t>(static_cast<const std::byte*>(feed) - bytes.data());
      keep(bytes.first(size), overlong);
      if (feed == nullptr) return;
      end_line(line);
      bytes = bytes.subspan(size + 1);
    }
  }

  // Whether bytes of an unfinished line are kept.
  [[nodiscard]] bool in_line() const noexcept { return length_ > 0; }

 private:
  template <typename Overlong>
  void keep(std::span<const std::byte> piece, const Overlong& overlong) noexcept {
    if (overlong_) return;
    overlong_ = piece.size() > text_.size() - length_;
    if (overlong_) return overlong();
    std::memcpy(text_.data() + length_, piece.data(), piece.size());
    length_ += piece.size();
    assert(length_ <= text_.size());
  }
  template <typename Line>
  void end_line(const Line& line) noexcept {
    std::string_view text(text_.data(), length_);
    while (text.ends_with('\r')) text.remove_suffix(1);
    length_ = 0;
    if (!overlong_ && !text.empty()) line(text);
    overlong_ = false;
  }

  std::array<char, max> text_{};
  std::size_t length_ = 0;
  bool overlong_ = false;  // the rest of the line is discarded
};

}  // namespace posed::drivers::glove
