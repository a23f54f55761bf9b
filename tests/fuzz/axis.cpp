// The Axis decoder on any bytes, whole and cut, and on messages with a right header and any values
// in them. The first byte selects what the rest is, the second how it is cut.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "drivers/axis/axis.hpp"
#include "drivers/axis/protocol.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::axis::Content;
using posed::test::CollectSink;
using Bytes = std::vector<std::byte>;

void demand(bool holds) {
  if (!holds) std::abort();
}

// A decoder that uses each description at once.
struct Listener {
  const posed::drivers::Driver& driver = posed::drivers::axis_driver();
  std::unique_ptr<posed::drivers::Decoder> decoder =
      driver.make_decoder(driver.describe("axis link=udp order=XZY rate=100", "fuzz").value())
          .value();
  std::vector<std::unique_ptr<const posed::drivers::SourceLayout>> layouts;
  CollectSink sink{0};
  std::int64_t now_ns = 0;

  void feed(std::span<const std::byte> bytes) {
    const int before = sink.descriptions;
    decoder->feed(bytes, now_ns, sink);
    now_ns += 100'000'000;
    for (const posed::Frame& frame : sink.frames) demand(posed::test::is_sound(frame));
    for (const std::size_t body : sink.bodies) demand(body < layouts.back()->bodies.size());
    sink.frames.clear();
    sink.bodies.clear();
    if (sink.descriptions == before) return;
    auto layout = driver.make_layout(sink.described);
    demand(layout.has_value());  // the decoder's own
    layouts.push_back(std::move(*layout));
    decoder->use(*layouts.back());
  }
};

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
  Listener whole;
  Listener cut;
  whole.decoder->feed(bytes, 0, whole.sink);
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    cut.decoder->feed(bytes.subspan(at, std::min(piece, bytes.size() - at)), 0, cut.sink);
  }
  demand(whole.sink.outcomes == cut.sink.outcomes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span bytes = std::as_bytes(std::span(data + 2, size - 2));
  const Content content{.displacement = (data[0] & 1) != 0, .reference = (data[0] & 2) != 0};
  Listener listener;
  switch (data[0] / 4 % 3) {
    case 0:
      try_cut(bytes, 1U + data[1]);
      listener.feed(bytes);
      listener.feed(bytes);
      break;
    case 1:
      for (int i = 0; i < 2; ++i) listener.feed(with_header(bytes, content));
      listener.feed(bytes);
      break;
    default:
      if (const auto layout = listener.driver.make_layout(bytes)) {
        demand((*layout)->bodies.size() <= posed::kMaxBodies);
      }
  }
  return 0;
}
