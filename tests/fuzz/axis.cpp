// The Axis decoder on any bytes, whole and cut, and on messages with a right header and any values
// in them. The first byte selects what the rest is, the second how it is cut.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "drivers/axis/protocol.hpp"
#include "drivers/driver.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::axis::Content;
using posed::fuzz::demand;
using posed::fuzz::feed;
using posed::test::CollectSink;
using Bytes = std::vector<std::byte>;

const posed::drivers::Driver& axis() { return *posed::drivers::find_driver("axis"); }

posed::drivers::Description description() {
  return axis().describe("axis link=udp order=XZY rate=100", "fuzz").value();
}

// A binary message with a right header; the bytes are its values.
Bytes with_header(std::span<const std::byte> bytes, Content content) {
  posed::drivers::axis::Message message;
  message.avatar = posed::drivers::axis::make_avatar(bytes.size() % 3, "fuzz");
  message.content = content;
  message.frame_number = static_cast<std::uint32_t>(bytes.size());
  Bytes packet(posed::drivers::axis::kMaxBinary);
  packet.resize(
      posed::drivers::axis::encode_binary(message, posed::drivers::axis::Form::kBinary, packet));
  const std::size_t room = packet.size() - posed::drivers::axis::kHeaderBytes;
  std::ranges::copy(bytes.first(std::min(room, bytes.size())),
                    packet.begin() + posed::drivers::axis::kHeaderBytes);
  return packet;
}

// A decoder counts the same however the bytes are cut.
void try_cut(std::span<const std::byte> bytes, std::size_t piece) {
  const auto decoder = axis().make_decoder(description()).value();
  const auto cut_decoder = axis().make_decoder(description()).value();
  CollectSink whole(0);
  CollectSink cut(0);
  feed(*decoder, bytes, 0, whole);
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    feed(*cut_decoder, bytes.subspan(at, std::min(piece, bytes.size() - at)), 0, cut);
  }
  demand(whole.outcomes == cut.outcomes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span bytes = std::as_bytes(std::span(data + 2, size - 2));
  const Content content{.displacement = (data[0] & 1) != 0, .reference = (data[0] & 2) != 0};
  posed::fuzz::Session session(axis(), description());
  std::int64_t now_ns = 0;
  const auto send = [&](std::span<const std::byte> chunk) {
    session.feed(chunk, now_ns);
    now_ns += 100'000'000;
  };
  switch (data[0] / 4 % 3) {
    case 0:
      try_cut(bytes, 1U + data[1]);
      send(bytes);
      send(bytes);
      break;
    case 1:
      for (int i = 0; i < 2; ++i) send(with_header(bytes, content));
      send(bytes);
      break;
    default:
      if (const auto layout = axis().make_layout(bytes)) {
        demand((*layout)->bodies.size() <= posed::kMaxBodies);
      }
  }
  return 0;
}
