// What `play` and `stop-playing` do at the request handler: an order of label indices for the hot
// side, or one sentence that says what is wrong.
#include <catch2/catch.hpp>

#include <deque>

#include "daemon/control/request_handler.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/daemon/control/three_streams.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::control {
namespace {

using pipeline::Command;

class QuietDaemonControl final : public DaemonControl {
 public:
  bool send(const Command& command) override {
    sent.push_back(command);
    return true;
  }
  bool send(const pipeline::DeviceCommand&) override { return true; }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t, const pipeline::StreamSettings&) override {}
  Result<pipeline::Take> mark_take(const pipeline::TakeMark&) override {
    return fail("not recording");
  }
  void fill(v1::Stats&) override {}
  void stop() override {}

  std::deque<Command> sent;
};

// A hand with a gesture model, one that is only smoothed, and a stream without the generate stage.
std::vector<ControlledStream> hands() {
  const auto skeleton = std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  std::vector<ControlledStream> streams(3);
  const char* const names[] = {"hand", "smooth", "plain"};
  for (int i = 0; i < 3; ++i) {
    streams[i].name = names[i];
    streams[i].skeleton = skeleton;
    streams[i].settings.rate_hz = 60.0;
    if (i == 2) continue;
    streams[i].settings.stages.push_back(pipeline::stage_settings(generate::generate_type()));
    streams[i].models.resize(1);
  }
  auto bound = generate::bind_model(test::toy_gesture_model(), *skeleton, 60.0, "toy.gesture");
  REQUIRE(bound);
  streams[0].models[0] = std::move(*bound);
  return streams;
}

struct PlayDesk {
  QuietDaemonControl daemon_control;
  HandlerRig rig{hands(), daemon_control};
  RequestHandler& handler = rig.handler;

  // The error sentence; empty if the request went on to the pipeline.
  std::string refusal(const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    const auto answer = handler.handle({"me"}, std::as_bytes(std::span(bytes)));
    if (!answer) return {};
    v1::ControlReply reply;
    REQUIRE(reply.ParseFromString(answer->bytes));
    CHECK_FALSE(reply.ok());
    return reply.error();
  }
};

v1::ControlRequest play(const std::string& stream, const std::vector<std::string>& labels,
                        float tempo = 1.0F) {
  v1::ControlRequest request;
  auto& wanted = *request.mutable_stage_command();
  wanted.set_stream(stream);
  wanted.set_name("play");
  for (const std::string& label : labels) wanted.add_word(label);
  (*wanted.mutable_number())["tempo"] = tempo;
  return request;
}

bool says(const std::string& sentence, const std::string& part) {
  UNSCOPED_INFO("'" << sentence << "'");
  return sentence.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a play becomes label indices, tempo and loop for its stream") {
  PlayDesk fixture;
  auto request = play("hand", {"g", "1", "p"}, 1.5F);
  (*request.mutable_stage_command()->mutable_number())["loop"] = 1.0;
  CHECK(fixture.refusal(request).empty());
  REQUIRE(fixture.daemon_control.sent.size() == 1);
  const Command& command = fixture.daemon_control.sent.front();
  CHECK(command.change.kind == pipeline::StageChange::Kind::kCommand);
  CHECK(command.change.index == generate::GenerateStage::kPlay);
  CHECK(command.stream == 0);
  const auto order = command.command.as<gesture::PlayOrder>();
  CHECK(order.loop);
  CHECK(order.tempo == 1.5F);
  const auto model = test::toy_gesture_model();
  REQUIRE(order.size == 3);
  CHECK(order.label[0] == model.label_index("g"));
  CHECK(order.label[1] == model.label_index("1"));
  CHECK(order.label[2] == model.label_index("p"));

  v1::ControlRequest stop;
  stop.mutable_stage_command()->set_stream("hand");
  stop.mutable_stage_command()->set_name("generate.stop-playing");
  CHECK(fixture.refusal(stop).empty());
  CHECK(fixture.daemon_control.sent.back().change.index == generate::GenerateStage::kStopPlaying);
}

TEST_CASE("an invalid play is refused with one sentence and reaches no stream") {
  PlayDesk fixture;
  CHECK(says(fixture.refusal(play("nobody", {"g"})), "nobody"));
  CHECK(says(fixture.refusal(play("plain", {"g"})), "[stream.generate]"));
  CHECK(says(fixture.refusal(play("smooth", {"g"})), "model"));
  CHECK_FALSE(fixture.refusal(play("hand", {})).empty());
  const std::string unknown = fixture.refusal(play("hand", {"g", "wave"}));
  CHECK(says(unknown, "wave"));
  CHECK(says(unknown, "g c p 1 3 4"));
  for (const float tempo : {-1.0F, 0.1F, 2.5F, std::numeric_limits<float>::quiet_NaN()}) {
    CHECK(says(fixture.refusal(play("hand", {"g"}, tempo)), "tempo"));
  }
  CHECK(says(fixture.refusal(play("hand", std::vector<std::string>(257, "g"))), "256"));
  CHECK_FALSE(fixture.refusal(play("hand", {std::string(5000, 'x')})).empty());
  CHECK(fixture.daemon_control.sent.empty());
}

}  // namespace posed::control
