// Control while streams come and go.
#include <atomic>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/control/request_handler.hpp"
#include "posed/v1/control.pb.h"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/daemon/control/requests.hpp"
#include "tests/unit/daemon/control/three_streams.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::control {
namespace {

using pipeline::Command;
using pipeline::stream_id;

constexpr std::uint32_t kAnn = stream_id(1, 1);
constexpr std::uint32_t kAnnAgain = stream_id(1, 2);

// Keeps the commands until the test, as the pipeline, acknowledges them.
class PatientDaemonControl final : public DaemonControl {
 public:
  bool send(const Command& command) override {
    const std::scoped_lock lock(mutex);
    sent.push_back(command);
    return true;
  }
  bool send(const pipeline::DeviceCommand& command) override {
    to_device = command.source;
    return true;
  }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t stream, const pipeline::StreamSettings&) override {
    changed = stream;
  }
  Result<pipeline::Take> mark_take(const pipeline::TakeMark&) override {
    return fail("not recording");
  }
  void fill(v1::Stats&) override {}
  void stop() override {}
  std::optional<Command> next() {
    const std::scoped_lock lock(mutex);
    if (sent.empty()) return std::nullopt;
    const Command command = sent.front();
    sent.pop_front();
    return command;
  }

  std::mutex mutex;
  std::deque<Command> sent;
  std::uint32_t changed = pipeline::kNoStream;
  std::uint32_t to_device = pipeline::kNoStream;
};

ControlledStream styled(const std::string& name, std::uint32_t stream = 0) {
  static const auto skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  ControlledStream made;
  made.stream = stream;
  made.name = name;
  made.skeleton = skeleton;
  made.settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  made.models.resize(1);
  return made;
}

ControlledStream ann(std::uint32_t stream) {
  ControlledStream made = styled("ann", stream);
  made.source = "optitrack";
  return made;
}

std::vector<ControlledStream> walker() {
  std::vector<ControlledStream> streams;
  streams.push_back(styled("walker"));
  return streams;
}

v1::ControlRequest set_alpha(const std::string& stream) { return alpha_request(stream, 0.5F); }

v1::ControlRequest set_model(const std::string& stream) {
  static const std::string bytes = style::serialize_model(test::toy_model(1, 0.3));
  return model_request(stream, bytes);
}

struct Stage {
  PatientDaemonControl pipeline;
  HandlerRig rig{walker(), pipeline};
  RequestHandler& handler = rig.handler;

  // The error sentence; empty if the request went on to the pipeline.
  std::string ask(const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    return error_of(handler.handle({"me"}, std::as_bytes(std::span(bytes))));
  }
  v1::ControlReply reply_to(const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    const auto answer = handler.handle({"me"}, std::as_bytes(std::span(bytes)));
    v1::ControlReply reply;
    REQUIRE(answer);
    REQUIRE(reply.ParseFromString(answer->bytes));
    return reply;
  }
  // The error sentence after the pipeline's answer; empty if it is a success.
  std::string acknowledge(const Command& command, bool refused, bool gone = false) {
    const auto answer = handler.acknowledge({.ticket = command.ticket,
                                             .stream = command.stream,
                                             .sequence = 5,
                                             .refused = refused,
                                             .gone = gone});
    REQUIRE(answer);
    return error_of(answer);
  }

 private:
  static std::string error_of(const std::optional<Reply>& answer) {
    v1::ControlReply reply;
    if (answer) REQUIRE(reply.ParseFromString(answer->bytes));
    return reply.error();
  }
};

}  // namespace

TEST_CASE("a stream can be controlled from when it comes until it leaves") {
  Stage stage;
  CHECK(stage.ask(set_alpha("ann")) == "there is no stream 'ann'; there is: walker");
  stage.handler.add_stream(ann(kAnn));
  CHECK(stage.ask(set_alpha("nobody")) == "there is no stream 'nobody'; there is: walker, ann");
  CHECK(stage.ask(set_model("ann")).empty());
  const auto command = stage.pipeline.next();
  REQUIRE(command);
  CHECK(command->stream == kAnn);
  CHECK(stage.acknowledge(*command, false).empty());
  CHECK(stage.pipeline.changed == kAnn);
  stage.handler.remove_stream(kAnn);
  stage.handler.remove_stream(kAnn);
  CHECK(stage.ask(set_alpha("ann")) == "there is no stream 'ann'; there is: walker");
  stage.handler.remove_stream(0);
  CHECK(stage.ask(set_alpha("ann")) == "there is no stream 'ann'; there is: none");
}

TEST_CASE("requests reach the newest generation; the earlier one keeps its models") {
  Stage stage;
  stage.handler.add_stream(ann(kAnn));
  CHECK(stage.ask(set_model("ann")).empty());
  const auto first = stage.pipeline.next();
  REQUIRE(first);
  CHECK(stage.ask(set_model("ann")).empty());
  const auto late = stage.pipeline.next();
  REQUIRE(late);
  CHECK(stage.acknowledge(*first, false).empty());
  stage.handler.add_stream(ann(kAnnAgain));
  CHECK(stage.ask(set_alpha("ann")).empty());
  CHECK(stage.pipeline.next()->stream == kAnnAgain);
  CHECK(first->model->name == "sway.style");  // under ASan: not freed
  CHECK(stage.ask(set_alpha("x")) == "there is no stream 'x'; there is: walker, ann");
  CHECK(stage.acknowledge(*late, true) == "stream 'ann': it has left before this took effect");
  stage.handler.remove_stream(kAnn);
  CHECK(stage.ask(set_alpha("ann")).empty());
}

TEST_CASE("a command under way to a stream that leaves is answered, and counts until then") {
  Stage stage;
  stage.handler.add_stream(ann(kAnn));
  CHECK(stage.ask(set_model("ann")).empty());
  for (std::size_t i = 1; i < kMaxUnderWay; ++i) CHECK(stage.ask(set_alpha("ann")).empty());
  stage.handler.remove_stream(kAnn);
  CHECK(stage.ask(set_alpha("walker")).starts_with("too many changes"));
  const auto model = stage.pipeline.next();
  REQUIRE(model);
  CHECK(model->model->name == "sway.style");  // under ASan: the pipeline may still look at it
  CHECK(stage.acknowledge(*model, true) == "stream 'ann': it has left before this took effect");
  CHECK(stage.ask(set_alpha("walker")).empty());
  CHECK(stage.ask(set_alpha("walker")).starts_with("too many changes"));
  // It took effect just before the stream left.
  CHECK(stage.acknowledge(*stage.pipeline.next(), false).empty());
}

TEST_CASE("a command that meets a changing body is answered so") {
  Stage stage;
  stage.handler.add_stream(ann(kAnn));
  // The pipeline does not have the stream, which control has as the newest of its name: the one
  // before it is still there.
  CHECK(stage.ask(set_alpha("ann")).empty());
  CHECK(stage.acknowledge(*stage.pipeline.next(), true, true) ==
        "stream 'ann': its body changes just now; try again");
}

TEST_CASE("what is set for a stream that is not there is kept until it comes, and stays") {
  Stage stage;
  config::StreamConfig config;
  config.name = "emma";
  config.stages.push_back(
      {.type = &style::style_type(),
       .parameters = complete_parameters(style::style_type().parameters, {}).value()});
  stage.handler.add_known(known_stream(config, "optitrack"));
  CHECK(stage.ask(set_alpha("x")) == "there is no stream 'x'; there is: walker, emma");

  // The reply comes at once: the pipeline has nothing to do.
  CHECK(stage.reply_to(set_alpha("emma")).ok());
  const v1::ControlReply reply = stage.reply_to(set_model("emma"));
  CHECK(reply.ok());
  CHECK(reply.stream() == "emma");
  CHECK(reply.sequence() == 0);
  CHECK_FALSE(stage.pipeline.next());
  CHECK(stage.ask(alpha_request("emma", 7.0F)).contains("out of range"));
  v1::ControlRequest warm_up;
  warm_up.mutable_stage_command()->set_stream("emma");
  warm_up.mutable_stage_command()->set_name("warm-up");
  CHECK(stage.ask(warm_up).contains("is not there now"));
  CHECK(stage.ask(model_request("emma", "no model")) != "");

  const auto kept = [&] {
    devices::LoadedStages loaded;
    loaded.settings.stages.push_back(pipeline::stage_settings(style::style_type()));
    loaded.model_files.resize(1);
    stage.rig.kept.apply("emma", loaded);
    return loaded;
  };
  CHECK(parameter<double>(kept().settings.stages[0].parameters, "alpha") == 0.5);
  CHECK(kept().settings.stages[0].model_name == "sway.style");
  REQUIRE(kept().model_files[0]);
  CHECK(*kept().model_files[0] == style::serialize_model(test::toy_model(1, 0.3)));

  // What is set while the stream is there stays, too, once it has taken effect.
  stage.handler.add_stream(styled("emma", kAnn));
  CHECK(stage.ask(alpha_request("emma", 0.75F)).empty());
  CHECK(parameter<double>(kept().settings.stages[0].parameters, "alpha") == 0.5);
  CHECK(stage.acknowledge(*stage.pipeline.next(), false).empty());
  stage.handler.remove_stream(kAnn);
  CHECK(parameter<double>(kept().settings.stages[0].parameters, "alpha") == 0.75);
  CHECK(stage.reply_to(set_alpha("emma")).ok());
}

TEST_CASE("calibrations and haptics are not for bodies of a device with several") {
  Stage stage;
  stage.handler.add_stream(ann(kAnn));
  v1::ControlRequest calibrate;
  calibrate.mutable_calibrate()->set_stream("ann");
  v1::ControlRequest haptics;
  haptics.mutable_haptics()->set_stream("ann");
  const std::string sentence =
      "stream ann is a body of source optitrack; calibrations and haptics are for gloves";
  CHECK(stage.ask(calibrate) == sentence);
  CHECK(stage.ask(haptics) == sentence);
  CHECK(stage.pipeline.to_device == pipeline::kNoStream);
}

TEST_CASE("streams come and go while clients ask and the pipeline answers") {
  Stage stage;
  std::atomic<bool> done{false};
  std::thread answers([&] {
    while (!done) {
      (void)stage.handler.forget_old(0);
      const auto command = stage.pipeline.next();
      if (!command) continue;
      const bool refused = command->ticket % 2 == 0;
      if (!stage.handler.acknowledge(
              {.ticket = command->ticket, .stream = command->stream, .refused = refused})) {
        std::abort();
      }
    }
  });
  std::thread client([&] {
    const std::string alpha = set_alpha("ann").SerializeAsString();
    const std::string model = set_model("ann").SerializeAsString();
    while (!done) {
      (void)stage.handler.handle({"me"}, std::as_bytes(std::span(alpha)));
      (void)stage.handler.handle({"me"}, std::as_bytes(std::span(model)));
    }
  });
  for (std::uint32_t generation = 1; generation <= 300; ++generation) {
    stage.handler.add_stream(ann(stream_id(1, generation)));
    if (generation > 1) stage.handler.remove_stream(stream_id(1, generation - 1));
    std::this_thread::yield();
  }
  done = true;
  answers.join();
  client.join();
  CHECK(stage.ask(set_alpha("x")) == "there is no stream 'x'; there is: walker, ann");
}

}  // namespace posed::control
