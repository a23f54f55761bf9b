// Any bytes as a control message, models and plays included: the result is a reply with an error
// message, or a well-formed command; nothing crashes, hangs or leaks.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "daemon/control/request_handler.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/fuzz/check_command.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace {

using namespace posed;

// A body with a style and a hand with gestures.
std::vector<control::ControlledStream> two_streams() {
  std::vector<control::ControlledStream> streams(2);
  streams[1].stream = 1;
  streams[1].name = "h";
  streams[1].skeleton = std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  streams[1].settings.rate_hz = 30.0;
  streams[1].settings.stages.push_back(pipeline::stage_settings(generate::generate_type()));
  streams[1].models.push_back(
      generate::bind_model(test::toy_gesture_model(), *streams[1].skeleton, 30.0, "toy").value());
  streams[0].name = "w";
  streams[0].skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  streams[0].settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  streams[0].models.resize(1);
  return streams;
}

void check(const control::Reply& answer) {
  v1::ControlReply reply;
  if (!reply.ParseFromString(answer.bytes)) std::abort();
  if (!reply.ok() && reply.error().empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::CheckingControl daemon_control(2);
  static devices::KeptSettings kept;
  static control::RequestHandler handler(daemon_control, kept);
  static const bool added = [] {
    for (control::ControlledStream& stream : two_streams()) handler.add_stream(std::move(stream));
    return true;
  }();
  if (!added) std::abort();
  if (const auto answer = handler.handle({}, std::as_bytes(std::span(data, size)))) check(*answer);
  for (const pipeline::Ack& ack : std::exchange(daemon_control.acks, {})) {
    const auto answer = handler.acknowledge(ack);
    if (!answer) std::abort();
    check(*answer);
  }
  return 0;
}
