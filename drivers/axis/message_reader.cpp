#include "drivers/axis/message_reader.hpp"

#include <algorithm>
#include <cstring>

namespace posed::drivers::axis {
namespace {

constexpr std::byte kMark{0xFF};  // the first byte of every header; no text contains it
constexpr std::byte kMotion{0xDD};
constexpr std::byte kCalculation{0x88};
constexpr std::byte kCalculationEnd{0x99};
constexpr std::size_t kCountAt = 6;  // the bytes before it are the same in all messages of a sender

RT_SAFE bool is_blank(std::byte byte) noexcept {
  const auto c = std::to_integer<unsigned>(byte);
  return c == ' ' || (c >= '\t' && c <= '\r');
}

RT_SAFE bool is_text(std::byte byte) noexcept {
  const auto c = std::to_integer<unsigned>(byte);
  return is_blank(byte) || (c > 0x20 && c != 0x7F && c != 0xFF);
}

}  // namespace

RT_SAFE void MessageReader::feed(std::span<const std::byte> bytes, Messages& messages) noexcept {
  while (!bytes.empty()) {
    if (end_ == buffer_.size()) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
      end_ -= begin_;
      begin_ = 0;
    }
    const std::size_t count = std::min(bytes.size(), buffer_.size() - end_);
    std::memcpy(buffer_.data() + end_, bytes.data(), count);
    end_ += count;
    bytes = bytes.subspan(count);
    while (begin_ != end_ && advance(messages)) {
    }
  }
}

RT_SAFE void MessageReader::drop(std::size_t count) noexcept {
  begin_ += count;
  scanned_ = 0;
  if (begin_ == end_) begin_ = end_ = 0;
}

RT_SAFE void MessageReader::count_damage(Outcome outcome, Messages& messages) noexcept {
  if (!in_damage_) messages.damage(outcome);
  in_damage_ = true;
}

RT_SAFE bool MessageReader::advance(Messages& messages) noexcept {
  const auto bytes = pending();
  if (scanned_ != 0 || overlong_) return advance_text(messages);
  if (is_blank(bytes[0])) {
    drop(1);
    return true;
  }
  if (bytes[0] != kMark) {
    if (is_text(bytes[0])) return advance_text(messages);
    count_damage(Outcome::kForeign, messages);
    drop(1);
    return true;
  }
  if (bytes.size() < 2) return false;
  if (bytes[1] == kMotion) return advance_binary(messages);
  if (bytes[1] == kCalculation) return advance_calculation(messages);
  count_damage(Outcome::kForeign, messages);
  drop(1);
  return true;
}

RT_SAFE bool MessageReader::advance_binary(Messages& messages) noexcept {
  const auto bytes = pending();
  if (bytes.size() < kHeaderBytes) return false;
  std::size_t size = 0;
  const Outcome outcome = measure_binary(bytes.first(kHeaderBytes), size);
  if (outcome != Outcome::kOk) {
    count_damage(outcome, messages);
    drop(2);
    return true;
  }
  if (bytes.size() < size) return false;
  // The next message begins inside this one if a datagram was lost or a connection was cut.
  const auto rest = bytes.subspan(kHeaderBytes, size - kHeaderBytes);
  const auto cut = std::ranges::search(rest, bytes.first(kCountAt));
  if (!cut.empty()) {
    count_damage(Outcome::kShort, messages);
    drop(kHeaderBytes + static_cast<std::size_t>(cut.begin() - rest.begin()));
    return true;
  }
  in_damage_ = !messages.binary(bytes.first(size), in_damage_) && in_damage_;
  drop(size);
  return true;
}

// The header of calculation data is counted; its values are then skipped as damage is.
RT_SAFE bool MessageReader::advance_calculation(Messages& messages) noexcept {
  const auto bytes = pending();
  if (bytes.size() < kHeaderBytes) return false;
  const auto end = bytes.subspan(kHeaderBytes - 2, 2);
  const bool header = end[0] == kMark && end[1] == kCalculationEnd;
  if (header) in_damage_ = false;  // each of them is counted
  count_damage(Outcome::kForeign, messages);
  drop(header ? kHeaderBytes : 2);
  return true;
}

RT_SAFE bool MessageReader::advance_text(Messages& messages) noexcept {
  const auto bytes = pending();
  constexpr std::byte kBar{'|'};
  std::size_t at = scanned_;
  while (at < bytes.size() && is_text(bytes[at])) {
    if (bytes[at] == kBar) {
      if (at + 1 == bytes.size()) break;
      if (bytes[at + 1] == kBar) {
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), at);
        if (!overlong_) messages.text(text, in_damage_);
        in_damage_ = overlong_ = false;
        drop(at + kTextEnd.size());
        return true;
      }
    }
    ++at;
  }
  if (at < bytes.size() && bytes[at] != kBar) {  // not text any more
    count_damage(Outcome::kShort, messages);
    overlong_ = false;
    drop(at);
    return true;
  }
  scanned_ = at;
  if (bytes.size() < buffer_.size()) return false;
  count_damage(Outcome::kShort, messages);
  overlong_ = true;
  drop(std::max<std::size_t>(at, 1));
  return true;
}

}  // namespace posed::drivers::axis
