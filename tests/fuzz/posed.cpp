// The decoder of another posed's stream on any bytes: as messages beside good ones that change, and
// as the body of a pose and of a skeleton. What its reader accepts, protobuf accepts.
#include <cstdint>
#include <span>
#include <string_view>

#include "drivers/chain/emulator.hpp"
#include "drivers/chain/protocol.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/fuzz/session.hpp"

namespace {

using posed::fuzz::demand;
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
  using posed::drivers::find_driver;
  static const auto good = posed::fuzz::emulated_datagrams(
      chain::UpstreamEmulator({.stream = "walker", .rate_hz = 60.0}), 64);
  const std::span bytes = std::as_bytes(std::span(data, size));
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  compare(bytes);
  posed::fuzz::Session session(*find_driver("posed"), find_driver("posed")->expect({}).value(),
                               posed::fuzz::DescriptionsOf::kSender);
  posed::fuzz::feed_pieces(session, good, bytes);
  session.feed(chain::join_message("pose/walker", text), 0);
  session.feed(chain::join_message("skeleton/walker", text), 0);
  session.feed(chain::join_message("pose/walker", text), 0);
  return 0;
}
