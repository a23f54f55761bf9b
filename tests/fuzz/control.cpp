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

// What the pipeline assumes about a play command.
void check_play(const pipeline::Command& command) {
  const auto play = command.command.as<gesture::PlayOrder>();
  if (command.stream != 1 || play.size == 0 || play.size > play.label.size()) std::abort();
  if (!(play.tempo >= 0.5F && play.tempo <= 2.0F)) std::abort();
}

class DaemonControl final : public control::DaemonControl {
 public:
  bool send(const pipeline::Command& command) override {
    fuzz::check_command(command);
    if (command.change.kind == pipeline::StageChange::Kind::kCommand &&
        command.change.index == generate::GenerateStage::kPlay) {
      check_play(command);
    }
    acks.push_back({.ticket = command.ticket, .stream = command.stream, .sequence = 1});
    return true;
  }
  bool send(const pipeline::DeviceCommand& command) override {
    if (command.size > command.bytes.size()) std::abort();
    if (command.ticket == 0) return true;
    acks.push_back({.ticket = command.ticket, .stream = command.source, .sequence = 1});
    return true;
  }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t stream, const posed::pipeline::StreamSettings&) override {
    if (stream > 1) std::abort();
  }
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override {
    if (!pipeline::check_take_name(mark.name)) std::abort();
    return pipeline::Take{.number = 1, .name = mark.name};
  }
  void fill(v1::Stats& stats) override { stats.set_rss_bytes(1); }
  void stop() override {}

  std::vector<pipeline::Ack> acks;
};

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
  static DaemonControl daemon_control;
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
