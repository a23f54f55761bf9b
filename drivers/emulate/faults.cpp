#include "drivers/emulate/faults.hpp"

#include <algorithm>
#include <array>

#include "proto/text/list.hpp"
#include "proto/text/number.hpp"

namespace posed::drivers::emulate {
namespace {

constexpr std::array<std::string_view, static_cast<std::size_t>(FaultKind::kCount)> kNames{
    "drop", "zero", "flip", "insert", "noise", "duplicate", "silence", "baud", "burst"};
constexpr std::int64_t kSilence_ns = 1'000'000'000;
constexpr std::int64_t kBaud_ns = 500'000'000;
constexpr std::int64_t kBurst_ns = 500'000'000;

// The byte that a receiver at half the sender's rate gets (8N1, least significant bit first): it
// samples every second bit of start bit, data and stop bit, so two bytes become one with a framing
// error.
std::byte at_half_rate(std::byte first, std::byte second) {
  const auto wire = static_cast<unsigned>(std::to_integer<unsigned>(first) << 1 | 1U << 9 |
                                          std::to_integer<unsigned>(second) << 11);
  unsigned read = 0;
  for (unsigned bit = 0; bit < 8; ++bit) read |= (wire >> (2 * bit + 2) & 1U) << bit;
  return static_cast<std::byte>(read);
}

}  // namespace

Result<Fault> parse_fault(std::string_view text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto kind = std::ranges::find(kNames, text.substr(0, colon));
  const auto rate = exact_number<double>(text.substr(std::min(colon + 1, text.size())));
  if (kind != kNames.end() && rate && *rate >= 0.0 && *rate <= 1.0) {
    return Fault{.kind = static_cast<FaultKind>(kind - kNames.begin()), .rate = *rate};
  }
  return misuse("a fault is KIND:RATE, the rate from 0 to 1, as drop:0.01; kinds: " +
                joined(kNames));
}

bool FaultInjector::strikes() {
  return static_cast<double>(random_() >> 11) * 0x1.0p-53 < fault_.rate;
}

bool FaultInjector::pass(std::span<const std::byte> packet, std::int64_t now_ns, Bytes& out) {
  return fault_.kind <= FaultKind::kNoise ? pass_bytes(packet, out)
                                          : pass_packet(packet, now_ns, out);
}

bool FaultInjector::pass_bytes(std::span<const std::byte> packet, Bytes& out) {
  bool whole = true;
  for (const std::byte byte : packet) {
    if (!strikes()) {
      out.push_back(byte);
      continue;
    }
    constexpr std::array kNoises{FaultKind::kDrop, FaultKind::kFlip, FaultKind::kInsert};
    whole = false;
    spoil(fault_.kind == FaultKind::kNoise ? kNoises[random_() % kNoises.size()] : fault_.kind,
          byte, out);
  }
  return whole;
}

void FaultInjector::spoil(FaultKind kind, std::byte byte, Bytes& out) {
  if (kind == FaultKind::kZero) out.push_back(std::byte{0});
  if (kind == FaultKind::kFlip) out.push_back(byte ^ static_cast<std::byte>(1U << random_() % 8));
  if (kind == FaultKind::kInsert) {
    out.push_back(any_byte());
    out.push_back(byte);
  }
}

bool FaultInjector::pass_packet(std::span<const std::byte> packet, std::int64_t now_ns,
                                Bytes& out) {
  const bool going_on = now_ns < until_ns_;
  const bool begins = !going_on && strikes();
  if (!going_on && !held_.empty()) {
    out.insert(out.end(), held_.begin(), held_.end());
    held_.clear();
  }
  const auto add = [&out](std::span<const std::byte> bytes) {
    out.insert(out.end(), bytes.begin(), bytes.end());
  };
  if (!going_on && !begins) {
    add(packet);
    return true;
  }
  switch (fault_.kind) {
    case FaultKind::kDuplicate:
      add(packet);
      add(packet);
      return true;
    case FaultKind::kSilence:
      if (begins) until_ns_ = now_ns + kSilence_ns;
      if (begins) add(packet.first(packet.size() / 2));
      return false;
    case FaultKind::kBaud:
      if (begins) until_ns_ = now_ns + kBaud_ns;
      for (std::size_t i = 0; i + 1 < packet.size(); i += 2) {
        out.push_back(at_half_rate(packet[i], packet[i + 1]));
      }
      return false;
    default:  // kBurst
      if (begins) until_ns_ = now_ns + kBurst_ns;
      held_.insert(held_.end(), packet.begin(), packet.end());
      return true;
  }
}

}  // namespace posed::drivers::emulate
