// What control messages do: the handler with a pipeline made by the test.
#include <atomic>
#include <cmath>
#include <deque>

#include <catch2/catch.hpp>

#include "daemon/control/request_handler.hpp"
#include "daemon/teach/teacher.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/whole_file.hpp"
#include "proto/log/digest.hpp"
#include "tests/support/has.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/control/requests.hpp"
#include "tests/unit/daemon/control/three_streams.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::control {
namespace {

using pipeline::Command;
using test::has;

class FakeDaemonControl final : public DaemonControl {
 public:
  bool send(const Command& command) override {
    if (full) return false;
    sent.push_back(command);
    return true;
  }
  bool send(const pipeline::DeviceCommand& command) override {
    if (full) return false;
    to_device.push_back(command);
    return true;
  }
  void keep_model(std::span<const std::byte> bytes) override { kept.push_back(bytes.size()); }
  void stages_changed(std::uint32_t stream, const pipeline::StreamSettings& settings) override {
    changed = {stream, settings};
  }
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override {
    if (!recording) return fail("not recording");
    marks.push_back(mark);
    return pipeline::Take{.number = 7, .name = mark.name, .start_ns = mark.time_ns};
  }
  void fill(v1::Stats& stats) override { stats.set_rss_bytes(42); }
  void stop() override { stopped = true; }

  std::deque<Command> sent;
  std::vector<pipeline::DeviceCommand> to_device;
  std::vector<std::size_t> kept;
  // The stream whose stages changed last, and what it has since.
  std::optional<std::pair<std::uint32_t, pipeline::StreamSettings>> changed;
  std::vector<pipeline::TakeMark> marks;
  bool recording = true;
  bool full = false;
  std::atomic<bool> stopped{false};
};

v1::ControlReply reply_of(const std::optional<Reply>& answer) {
  v1::ControlReply reply;
  REQUIRE(answer);
  CHECK(answer->to == Requester{"me"});
  REQUIRE(reply.ParseFromString(answer->bytes));
  return reply;
}

struct Fixture {
  FakeDaemonControl daemon_control;
  HandlerRig rig{three_streams(), daemon_control};
  RequestHandler& handler = rig.handler;

  std::optional<Reply> ask(const std::string& bytes) {
    return handler.handle({"me"}, std::as_bytes(std::span(bytes)));
  }
  std::optional<Reply> ask(const v1::ControlRequest& request) {
    return ask(request.SerializeAsString());
  }
  // The error sentence of a refusal.
  std::string refused(const v1::ControlRequest& request) {
    const auto reply = reply_of(ask(request));
    CHECK_FALSE(reply.ok());
    CHECK(daemon_control.sent.empty());
    return reply.error();
  }
  // The error sentence for a model that takes several pieces.
  std::string refused_in_pieces(const std::string& stream, const std::string& model) {
    auto request = model_request(stream, model);
    auto& part = *request.mutable_model_part();
    for (std::size_t offset = 0; offset < model.size(); offset += kMaxPiece) {
      part.set_offset(offset);
      part.set_bytes(model.substr(offset, kMaxPiece));
      const auto reply = reply_of(ask(request));
      if (!reply.ok()) return reply.error();
    }
    return {};
  }
  v1::ControlReply acknowledge(std::uint64_t sequence) {
    const Command command = daemon_control.sent.front();
    daemon_control.sent.pop_front();
    return reply_of(handler.acknowledge(
        {.ticket = command.ticket, .stream = command.stream, .sequence = sequence}));
  }
};

TEST_CASE("while the models of a folder are read, other requests are answered") {
  const test::TempFolder folder;
  for (const char* name : {"c.style", "a.style", "b.style"}) {
    REQUIRE(write_whole_file(folder.path() / name, "no model"));
  }
  // Each look at the clock takes a second.
  const Clock slow = []() noexcept {
    static std::atomic<std::int64_t> now_ns{0};
    return now_ns += kNanosPerSecond;
  };
  FakeDaemonControl daemon_control;
  HandlerRig rig(three_streams(), daemon_control, ModelFolder::open(folder.path()).value(), slow);
  v1::ControlRequest request;
  request.mutable_list_models();
  const auto ask = [&] {
    const std::string bytes = request.SerializeAsString();
    return rig.handler.handle({"me"}, std::as_bytes(std::span(bytes)));
  };
  CHECK_FALSE(rig.handler.is_listing());
  CHECK_FALSE(ask());
  CHECK(rig.handler.is_listing());
  CHECK_FALSE(rig.handler.list_on());
  request.mutable_status();
  CHECK(reply_of(ask()).ok());
  const v1::ControlReply reply = reply_of(rig.handler.list_on());
  CHECK_FALSE(rig.handler.is_listing());
  REQUIRE(reply.model_size() == 3);
  CHECK(reply.model(0).name() == "a.style");
  CHECK(reply.model(2).name() == "c.style");
  // One that is deleted before its turn is not there, as if it had never been.
  request.mutable_list_models();
  REQUIRE(write_whole_file(folder.path() / "b.style", "another"));
  CHECK_FALSE(ask());
  std::filesystem::remove(folder.path() / "b.style");
  std::optional<Reply> listed;
  while (!listed) listed = rig.handler.list_on();
  const v1::ControlReply without = reply_of(listed);
  REQUIRE(without.model_size() == 2);
  CHECK(without.model(1).name() == "c.style");
  // Many who ask at once are told to come again.
  int waiting = 0;
  while (!ask()) REQUIRE(++waiting <= 100);
  CHECK(waiting == 16);
}

TEST_CASE("teaching is refused, before anybody walks, where it could not end well") {
  const test::TempFolder folder;
  teach::Teacher teacher(
      [](teach::Subject, const std::string&, std::string_view) { return fail("never"); }, [] {});
  FakeDaemonControl daemon_control;
  HandlerRig rig(three_streams(), daemon_control, ModelFolder::open(folder.path()).value(),
                 system::monotonic_ns, &teacher);
  v1::ControlRequest request;
  auto& wanted = *request.mutable_teach();
  const auto answer = [&] {
    const std::string bytes = request.SerializeAsString();
    return reply_of(rig.handler.handle({"me"}, std::as_bytes(std::span(bytes))));
  };
  wanted.mutable_mark()->set_seconds(2.0);
  for (const auto& [stream, why] : {std::pair{"plain", "'plain': ... no style stage"},
                                    {"runner", "'runner': ... publish_raw = true"},
                                    {"nobody", "no stream 'nobody'"},
                                    {"walker", "6 to 120 s"}}) {
    wanted.set_stream(stream);
    CHECK(has(answer().error(), why));
  }
  wanted.mutable_train()->set_name("../walk");
  CHECK(has(answer().error(), "'../walk' ... a-z"));
  wanted.mutable_train()->set_name("walk");
  CHECK(has(answer().error(), "no good walk"));
  wanted.mutable_mark()->set_seconds(20.0);
  const auto begun = answer();
  CHECK(begun.ok());
  CHECK(begun.teaching().step() == v1::Teaching::STEP_MARKING);
  CHECK(begun.teaching().seconds_left() > 0.0);
  CHECK(daemon_control.sent.empty());

  Fixture without_folder;
  CHECK(has(without_folder.refused(request), "no folder ... models = \"models\""));
}

TEST_CASE("a model that a stream uses is neither renamed nor deleted") {
  const test::TempFolder folder;
  for (const char* name : {"used.style", "free.style"}) {
    REQUIRE(write_whole_file(folder.path() / name, "no model"));
  }
  auto streams = three_streams();
  streams[0].settings.stages.front().model_name = "used.style";
  FakeDaemonControl daemon_control;
  HandlerRig rig(std::move(streams), daemon_control, ModelFolder::open(folder.path()).value());
  const auto answer = [&](const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    return reply_of(rig.handler.handle({"me"}, std::as_bytes(std::span(bytes))));
  };
  v1::ControlRequest request;
  request.mutable_delete_model()->set_name("used.style");
  CHECK(has(answer(request).error(), "'walker' uses it"));
  request.mutable_rename_model()->set_name("used.style");
  request.mutable_rename_model()->set_to("other");
  CHECK(has(answer(request).error(), "'walker' uses it"));
  request.mutable_rename_model()->set_name("free.style");
  CHECK(answer(request).ok());
  request.mutable_list_models();
  const std::uint64_t beats = rig.handler.pulse().beats();
  const auto listed = answer(request);
  REQUIRE(listed.model_size() == 2);
  CHECK(rig.handler.pulse().beats() >= beats + 2);  // each model is a sign of life
  CHECK(listed.model(0).name() == "other.style");
  CHECK(has(listed.model(0).verdict(), "other.style"));  // what is wrong with the file
  request.mutable_delete_model()->set_name("other.style");
  CHECK(answer(request).ok());
  CHECK_FALSE(answer(request).ok());
  request.mutable_list_recordings();
  CHECK(has(answer(request).error(), "recordings ="));
}

TEST_CASE("the only model is taken off a stream, and may then be renamed") {
  const test::TempFolder folder;
  REQUIRE(write_whole_file(folder.path() / "used.style", "no model"));
  auto streams = three_streams();
  streams[0].settings.stages.front().model_name = "used.style";
  FakeDaemonControl daemon_control;
  HandlerRig rig(std::move(streams), daemon_control, ModelFolder::open(folder.path()).value());
  const auto ask = [&](const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    return rig.handler.handle({"me"}, std::as_bytes(std::span(bytes)));
  };
  v1::ControlRequest rename;
  rename.mutable_rename_model()->set_name("used.style");
  rename.mutable_rename_model()->set_to("other");
  CHECK(has(reply_of(ask(rename)).error(), "another model, or none"));
  v1::ControlRequest none;
  none.mutable_use_model()->set_stream("walker");
  none.mutable_use_model()->set_name("none");
  none.mutable_use_model()->set_stage("generate");
  CHECK(has(reply_of(ask(none)).error(), "uses no model"));
  none.mutable_use_model()->clear_stage();
  REQUIRE_FALSE(ask(none));  // the pipeline answers
  const Command command = daemon_control.sent.front();
  CHECK(command.change.kind == pipeline::StageChange::Kind::kModel);
  CHECK(command.model == nullptr);
  CHECK(std::string(command.model_hash.data()).empty());
  const auto reply = reply_of(rig.handler.acknowledge(
      {.ticket = command.ticket, .stream = command.stream, .sequence = 12}));
  CHECK(reply.sequence() == 12);
  CHECK(daemon_control.changed->second.stages.front().model_name.empty());
  CHECK(has(reply_of(ask(none)).error(), "uses no model"));
  CHECK(reply_of(ask(rename)).ok());
}

TEST_CASE("a take is marked and answered with its number, or refused with a reason") {
  Fixture fixture;
  v1::ControlRequest request;
  request.mutable_take()->set_start(true);
  request.mutable_take()->set_name("walk \u00e4");
  const auto begun = reply_of(fixture.ask(request));
  CHECK(begun.ok());
  CHECK(begun.take().number() == 7);
  CHECK(begun.take().name() == "walk \u00e4");
  REQUIRE(fixture.daemon_control.marks.size() == 1);
  CHECK(fixture.daemon_control.marks[0].start);
  for (const auto& [name, why] : {std::pair{std::string(129, 'x'), "129 bytes"},
                                  {std::string("a\nb"), "cannot be printed"}}) {
    request.mutable_take()->set_name(name);
    CHECK(has(fixture.refused(request), why));
  }
  request.mutable_take()->set_start(false);
  request.mutable_take()->set_name("walk");
  CHECK(has(fixture.refused(request), "when it begins"));
  request.mutable_take()->clear_name();
  CHECK(reply_of(fixture.ask(request)).ok());
  CHECK_FALSE(fixture.daemon_control.marks[1].start);
  fixture.daemon_control.recording = false;
  CHECK(has(fixture.refused(request), "not recording"));
}

TEST_CASE("an alpha goes to its stream, and the reply comes when it took effect") {
  Fixture fixture;
  CHECK_FALSE(fixture.ask(alpha_request("runner", -2.0F)));
  REQUIRE(fixture.daemon_control.sent.size() == 1);
  CHECK(fixture.daemon_control.sent[0].change.type == &style::style_type());
  CHECK(fixture.daemon_control.sent[0].change.index ==
        test::parameter_index(style::style_type(), "alpha"));
  CHECK(fixture.daemon_control.sent[0].stream == 2);
  CHECK(fixture.daemon_control.sent[0].change.value == -2.0);
  const auto reply = fixture.acknowledge(77);
  CHECK(reply.ok());
  CHECK(reply.stream() == "runner");
  CHECK(reply.sequence() == 77);
}

TEST_CASE("a model is parsed, bound, kept and owned until the next one took effect") {
  Fixture fixture;
  const std::string bytes = style::serialize_model(test::toy_model(1, 0.3));
  CHECK_FALSE(fixture.ask(model_request("walker", bytes)));
  REQUIRE(fixture.daemon_control.sent.size() == 1);
  const Command command = fixture.daemon_control.sent[0];
  REQUIRE(command.model != nullptr);
  CHECK(command.model->name == "sway.style");
  CHECK(std::string(command.model_hash.data()) == log::sha256_hex(std::as_bytes(std::span(bytes))));
  CHECK(fixture.daemon_control.kept == std::vector<std::size_t>{bytes.size()});
  CHECK_FALSE(fixture.daemon_control.changed);
  CHECK(fixture.acknowledge(5).sequence() == 5);
  REQUIRE(fixture.daemon_control.changed);
  CHECK(fixture.daemon_control.changed->first == 0);
  CHECK(fixture.daemon_control.changed->second.stages[0].model_name == "sway.style");
  for (int i = 0; i < 10; ++i) {  // under ASan: no leak, and no model freed too early
    CHECK_FALSE(fixture.ask(model_request("walker", bytes)));
    const auto* bound = fixture.daemon_control.sent.front().model;
    CHECK(fixture.acknowledge(6).ok());
    CHECK(bound->name == "sway.style");
  }
  CHECK_FALSE(fixture.ask(model_request("walker", bytes)));  // never acknowledged
}

TEST_CASE("status and stop get a reply at once") {
  Fixture fixture;
  v1::ControlRequest request;
  request.mutable_status();
  CHECK(reply_of(fixture.ask(request)).status().rss_bytes() == 42);
  request.mutable_stop();
  CHECK(reply_of(fixture.ask(request)).ok());
  CHECK(fixture.daemon_control.stopped);
}

TEST_CASE("each refusal is a single sentence") {
  Fixture fixture;
  CHECK(has(fixture.refused(alpha_request("nobody", 0.0F)),
            "there is no stream 'nobody'; there is: walker, plain, runner"));
  CHECK(has(fixture.refused(alpha_request("walker-raw", 0.0F)), "before its stages"));
  CHECK(
      has(fixture.refused(alpha_request("plain", 0.0F)),
          "stream 'plain': 'alpha' is a parameter of stage style, which the stream does not have"));
  for (const float alpha : {2.1F, -3.0F, NAN, INFINITY}) {
    CHECK(has(fixture.refused(alpha_request("walker", alpha)), "out of range"));
  }
  CHECK(has(fixture.refused(alpha_request("\x1b[2J", 0.0F)), "'\\x1b[2J'"));
  CHECK(has(fixture.refused({}), "is empty"));
  CHECK(has(reply_of(fixture.ask(std::string("\xff\xff\xff"))).error(), "not a valid posed.v1"));

  const std::string good = style::serialize_model(test::toy_model(1, 0.3));
  CHECK(has(fixture.refused(model_request("walker", "")), "a model file has 1 to"));
  CHECK(
      has(fixture.refused(model_request("walker", good.substr(0, good.size() - 1))), "sway.style"));
  std::string flipped = good;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  CHECK(has(fixture.refused(model_request("walker", flipped)), "sway.style"));
  CHECK(fixture.daemon_control.kept.empty());

  fixture.daemon_control.full = true;
  CHECK(has(fixture.refused(alpha_request("walker", 0.0F)), "too many changes"));
}

TEST_CASE("any live parameter of any stage can be set, by its name or with the stage before it") {
  Fixture fixture;
  const auto ask = [&](const std::string& name, auto&& fill) {
    v1::ControlRequest request;
    request.mutable_set_parameter()->set_stream("walker");
    request.mutable_set_parameter()->set_name(name);
    fill(*request.mutable_set_parameter());
    return request;
  };
  const auto number = [](double value) {
    return [value](auto& wanted) { wanted.set_number(value); };
  };
  const auto flag = [](auto& wanted) { wanted.set_flag(true); };
  const auto text = [](auto& wanted) { wanted.set_text("much"); };
  CHECK_FALSE(fixture.ask(ask("style.alpha", number(0.5))));
  CHECK_FALSE(fixture.ask(ask("style.auto_alpha", flag)));
  CHECK(fixture.daemon_control.sent[0].change.index ==
        test::parameter_index(style::style_type(), "alpha"));
  CHECK(fixture.daemon_control.sent[1].change.index ==
        test::parameter_index(style::style_type(), "auto_alpha"));
  CHECK(fixture.daemon_control.sent[1].change.value == 1.0);
  fixture.daemon_control.sent.clear();
  CHECK(has(fixture.refused(ask("alpha", number(2.5))),
            "alpha = 2.5 is out of range: it takes a number from -2 to 2"));
  CHECK(has(fixture.refused(ask("alpha", flag)), "alpha must be a number, not true or false"));
  CHECK(has(fixture.refused(ask("alpha", text)), "alpha must be a number, not text"));
  CHECK(has(fixture.refused(ask("auto_alpha", number(1.0))), "auto_alpha must be true or false"));
  CHECK(has(fixture.refused(ask("warm_up_s", number(10.0))),
            "warm_up_s cannot change while the daemon runs"));
  CHECK(has(fixture.refused(ask("lag_ms", number(1.0))), "[stream.generate] table"));
  CHECK(has(fixture.refused(ask("beta", number(1.0))),
            "there is no parameter 'beta'; there is: style.alpha"));
  CHECK(has(fixture.refused(ask("feet.alpha", number(1.0))), "there is no parameter"));
  CHECK(has(fixture.refused(ask("", number(1.0))), "there is no parameter ''"));
}

TEST_CASE("a live text is sent as its stage's command, made for the model that will be there") {
  Fixture fixture;
  const auto ask = [&](const std::string& name, const std::string& text) {
    v1::ControlRequest request;
    request.mutable_set_parameter()->set_stream("walker");
    request.mutable_set_parameter()->set_name(name);
    request.mutable_set_parameter()->set_text(text);
    return request;
  };
  CHECK(has(fixture.refused(ask("weights", "s1=1")), "there is no style model"));
  const std::string model = style::serialize_model(test::toy_styles({1, 2}));
  CHECK_FALSE(fixture.ask(model_request("walker", model)));
  CHECK_FALSE(fixture.ask(ask("style.weights", "s1=1,s2=3")));
  CHECK_FALSE(fixture.ask(ask("mask", "arms=0.5")));
  const auto& sent = fixture.daemon_control.sent;
  REQUIRE(sent.size() == 3);
  CHECK(sent[1].change.kind == pipeline::StageChange::Kind::kCommand);
  CHECK(sent[1].change.index == style::StyleFilter::kWeights);
  CHECK(sent[1].command.as<style::Shares>().of[1] == 0.75);
  CHECK(sent[2].change.index == style::StyleFilter::kMask);
  CHECK(sent[2].command.as<style::Mask>()[2] == 0.5);
  for (int i = 0; i < 3; ++i) CHECK(fixture.acknowledge(9).ok());
  const auto& reported = fixture.daemon_control.changed->second.stages[0];
  CHECK(reported.model_words == std::vector<std::string>{"s1", "s2"});
  CHECK(std::get<std::string>(reported.parameters.at("weights")) == "s1=1,s2=3");
  CHECK(std::get<std::string>(reported.parameters.at("mask")) == "arms=0.5");
  CHECK(has(fixture.refused(ask("weights", "sad=1")), "no style 'sad'; it has: s1, s2"));
  CHECK(has(fixture.refused(ask("weights", "s1=0")), "all are 0"));
  CHECK(has(fixture.refused(ask("weights", "s1=1,")), "is not NAME=NUMBER"));
  CHECK(has(fixture.refused(ask("weights", "s1=1," + std::string(70, 'x') + "=1")), "too long"));
  CHECK(has(fixture.refused(ask("mask", "tail=1")), "no part 'tail'"));
  auto number = ask("weights", "");
  number.mutable_set_parameter()->set_number(0.5);
  CHECK(has(fixture.refused(number), "weights must be text"));
}

TEST_CASE("a refusal repeats an untrusted name cleaned and cut") {
  Fixture fixture;
  const std::string wild = "\x1b[2J" + std::string(60'000, 'x');
  const std::string stream = fixture.refused(alpha_request(wild, 0.0F));
  CHECK(has(stream, "there is no stream '\\x1b[2Jxxx"));
  CHECK(stream.size() < 300);
  auto named = model_request("walker", "no model");
  named.mutable_model_part()->set_name(wild);
  const std::string name = fixture.refused(named);
  CHECK(name.find('\x1b') == std::string::npos);
  CHECK(name.size() < 300);
  // The sentence names the joints of the model that the stream lacks.
  auto model = test::toy_model(1, 0.3);
  model.space.joints.back() = "\x1b[2J" + std::string(1 << 20, 'x');
  const std::string joints = fixture.refused_in_pieces("walker", style::serialize_model(model));
  CHECK(has(joints, "it has no joint \\x1b[2Jxxx"));
  CHECK(joints.size() < 1000);
}

TEST_CASE("requests are bounded in size and in number") {
  Fixture fixture;
  auto request = alpha_request("walker", 0.0F);
  request.mutable_set_parameter()->set_stream(std::string(kMaxRequest, 'x'));
  CHECK(has(fixture.refused(request), "too large"));
  CHECK(has(fixture.refused(model_request("walker", std::string(kMaxPiece + 1, 'x'))),
            "a piece of a model has"));
  for (std::size_t i = 0; i < kMaxUnderWay; ++i) {
    CHECK_FALSE(fixture.ask(alpha_request("walker", 1.0F)));
  }
  const auto one_more = reply_of(fixture.ask(alpha_request("walker", 1.0F)));
  CHECK(has(one_more.error(), "too many changes"));
  CHECK(fixture.acknowledge(1).ok());
  CHECK_FALSE(fixture.ask(alpha_request("walker", 1.0F)));
}

TEST_CASE("an acknowledgement of an unknown command gives no reply") {
  Fixture fixture;
  CHECK_FALSE(fixture.handler.acknowledge({.ticket = 99, .stream = 0}));
}

}  // namespace
}  // namespace posed::control
