// The decoder of another posed's stream on any bytes: as a message, as the body of a pose and of a
// skeleton, with the skeleton of the emulator in use. What its reader accepts, protobuf accepts.
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/posed/decoder.hpp"
#include "drivers/posed/emulator.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::fuzz::demand;
using posed::fuzz::feed;
using posed::test::CollectSink;
namespace chain = posed::drivers::chain;

// The numbers that were read are those that protobuf reads; text that is not UTF-8 is refused by
// protobuf alone.
void compare(std::span<const std::byte> bytes) {
  chain::UpstreamFrame frame;
  posed::v1::Frame message;
  if (chain::read_frame(bytes, frame) != posed::Outcome::kOk) return;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  demand(frame.sequence == message.sequence());
  demand(frame.skeleton_id == message.skeleton_id());
  demand(static_cast<int>(frame.rotation_xyzw.count) == message.rotation_xyzw_size());
  demand(static_cast<int>(frame.angle_rad.count) == message.angle_rad_size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes = std::as_bytes(std::span(data, size));
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  compare(bytes);
  chain::UpstreamDecoder decoder("walker");
  CollectSink sink(0);
  feed(decoder, bytes, 0, sink);
  chain::UpstreamEmulator emulator({.stream = "walker", .rate_hz = 60.0});
  std::vector<std::byte> skeleton;
  emulator.emit(0, skeleton);
  feed(decoder, skeleton, 0, sink);
  const auto layout = chain::make_layout(sink.described);
  demand(layout.has_value());
  decoder.use(**layout);
  feed(decoder, chain::join_message("pose/walker", text), 0, sink);
  feed(decoder, chain::join_message("skeleton/walker", text), 0, sink);
  if (const auto any = chain::make_layout(bytes)) {
    demand((*any)->bodies.size() == 1);
    decoder.use(**any);
    feed(decoder, chain::join_message("pose/walker", text), 0, sink);
  }
  posed::fuzz::demand_sound(sink);
  return 0;
}
