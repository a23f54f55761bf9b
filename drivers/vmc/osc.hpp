// Reads OSC 1.0 packets: messages and bundles of them. All numbers are big-endian, and everything
// is padded with zeros to a multiple of 4 bytes (opensoundcontrol.stanford.edu/spec-1_0.html):
//
//   message   "/address" 0.. | ",types" 0.. | the arguments that the types name, one after the
//   other bundle    "#bundle" 0 | time (u64) | then each element: size (i32) | message or bundle
//
//   types     i i32, f f32, s S text 0.., b i32 size and bytes, h d t 8 bytes, c r m 4 bytes,
//             T F N I nothing
//
// A packet is checked as a whole before anything of it is used. A message of a bundle that cannot
// be read, such as one with a type of a later OSC, is passed over, because the bundle says its
// size; of the others, an argument may be missing or have another type. RT-safe.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::vmc {

inline constexpr int kMaxBundleDepth = 8;  // of bundles in bundles

// Views of the packet.
struct OscMessage {
  std::string_view address;
  std::string_view types;  // without the comma
  std::span<const std::byte> arguments;
};

// Takes the arguments in order. One that is missing or is neither a number nor a text, as wanted,
// gives zero or empty text and clears ok(). Any type of number is taken for a number: some senders
// write doubles, and 0 and 1 as integers (node-osc) or as T and F.
class OscArguments {
 public:
  explicit OscArguments(const OscMessage& message) noexcept
      : types_(message.types), reader_(message.arguments) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t left() const noexcept { return types_.size(); }
  [[nodiscard]] double number() noexcept;
  [[nodiscard]] float f32() noexcept { return static_cast<float>(number()); }
  [[nodiscard]] std::string_view text() noexcept;

 private:
  // The type of the next argument, which then counts as taken; 0 when there is none.
  [[nodiscard]] char next() noexcept {
    ok_ = ok_ && !types_.empty();
    if (!ok_) return 0;
    const char type = types_.front();
    types_.remove_prefix(1);
    return type;
  }

  std::string_view types_;
  BigEndianReader reader_;
  bool ok_ = true;
};

// kForeign: neither a message nor a bundle; kShort: cut, a size that is wrong, too many bundles in
// bundles, or a single message that cannot be read.
[[nodiscard]] Outcome check_packet(std::span<const std::byte> packet) noexcept;

// Reads a message of a checked packet; false for one that is broken or has an unknown type. A
// message without types has no arguments.
[[nodiscard]] bool read_message(std::span<const std::byte> bytes, OscMessage& message) noexcept;

[[nodiscard]] bool is_bundle(std::span<const std::byte> packet) noexcept;
inline constexpr std::size_t kBundleHeadBytes = 16;

// Calls handle(message) for each message of a checked packet, in their order; returns false if some
// could not be read.
template <typename Handle>
bool each_message(std::span<const std::byte> packet, Handle&& handle) noexcept {
  if (!is_bundle(packet)) {
    OscMessage message;
    if (!read_message(packet, message)) return false;
    handle(message);
    return true;
  }
  bool all = true;
  BigEndianReader reader(packet.subspan(kBundleHeadBytes));
  while (reader.left() != 0) all &= each_message(reader.bytes(reader.u32()), handle);
  return all;
}

}  // namespace posed::drivers::vmc
