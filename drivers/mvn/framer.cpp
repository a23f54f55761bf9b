#include "drivers/mvn/framer.hpp"

#include <string_view>

namespace posed::drivers::mvn {
namespace {

constexpr std::string_view kStart = "MXTP";

// Whether a datagram may begin here, as far as the bytes tell.
bool may_start(std::span<const std::byte> bytes) noexcept {
  const std::size_t known = std::min(bytes.size(), kStart.size());
  return std::ranges::equal(bytes.first(known), std::as_bytes(std::span(kStart)).first(known));
}

std::size_t until_start(std::span<const std::byte> bytes) noexcept {
  std::size_t at = 1;
  while (at < bytes.size() && !may_start(bytes.subspan(at))) ++at;
  return at;
}

}  // namespace

Framer::Next Framer::look(std::span<const std::byte> bytes) noexcept {
  if (!may_start(bytes)) return {.skip = until_start(bytes)};
  if (bytes.size() < kHeadBytes) return {};
  Head head;
  const bool valid = read_head(bytes, head) && head.payload_bytes <= kMaxPayload &&
                     is_right_size(head, head.payload_bytes);
  if (!valid) return {.skip = until_start(bytes)};
  const std::size_t whole = kHeadBytes + head.payload_bytes;
  if (bytes.size() < whole) return {};
  return {.whole = whole};
}

}  // namespace posed::drivers::mvn
