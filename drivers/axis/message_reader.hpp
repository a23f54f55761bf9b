// MessageReader finds the messages in the bytes of an Axis stream, binary or text, from the bytes
// alone. Chunks may be cut anywhere: over TCP, and over UDP where some systems send a message in
// several datagrams (the first of 1024 bytes). After damage it goes on with the next message.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "drivers/axis/protocol.hpp"

namespace posed::drivers::axis {

// Receives what a MessageReader finds. RT-safe.
class Messages {
 public:
  Messages() = default;
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  virtual ~Messages() = default;

  // Receives a whole message. The callee counts it, unless `in_damage` is set and it is not valid:
  // then it belongs to damage that was counted already. A binary one says whether it was valid.
  [[nodiscard]] virtual bool binary(std::span<const std::byte> bytes, bool in_damage) noexcept = 0;
  virtual void text(std::string_view text, bool in_damage) noexcept = 0;
  // Bytes that are no message; once for all until the next valid one.
  virtual void damage(Outcome outcome) noexcept = 0;
};

class MessageReader {
 public:
  RT_SAFE void feed(std::span<const std::byte> bytes, Messages& messages) noexcept;

 private:
  // Each returns false when more bytes are needed.
  [[nodiscard]] bool advance(Messages& messages) noexcept;
  [[nodiscard]] bool advance_binary(Messages& messages) noexcept;
  [[nodiscard]] bool advance_calculation(Messages& messages) noexcept;
  [[nodiscard]] bool advance_text(Messages& messages) noexcept;
  void count_damage(Outcome outcome, Messages& messages) noexcept;
  void drop(std::size_t count) noexcept;
  [[nodiscard]] std::span<const std::byte> pending() const noexcept {
    return std::span(buffer_).subspan(begin_, end_ - begin_);
  }

  std::array<std::byte, kMaxText> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  // of the pending bytes
  std::size_t scanned_ = 0;          // pending bytes of a text that were looked at
  bool in_damage_ = false;           // counted; no valid message since
  bool overlong_ = false;            // a text without end: discarded up to its end
};

}  // namespace posed::drivers::axis
