// The trigger: what capture systems send becomes takes, and nothing else does.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "daemon/control/trigger.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/support/has.hpp"

namespace posed::control {
namespace {

using test::has;

std::string start_text(const std::string& children) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"no\" ?>\n<CaptureStart>" +
         children + "</CaptureStart>";
}

std::string trigger_error(const std::string& datagram) {
  const auto message = parse_trigger(datagram);
  return message ? "" : message.error().message;
}

// Keeps the marks.
class TakeKeeper final : public DaemonControl {
 public:
  bool send(const pipeline::Command&) override { return false; }
  bool send(const pipeline::DeviceCommand&) override { return false; }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t, const pipeline::StreamSettings&) override {}
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override {
    if (!pipeline::check_take_name(mark.name)) return fail("a bad name");
    if (!recording) return fail("not recording");
    marks.push_back(mark);
    return pipeline::Take{.number = static_cast<std::uint32_t>(marks.size())};
  }
  void fill(v1::Stats&) override {}
  void stop() override {}

  std::vector<pipeline::TakeMark> marks;
  bool recording = true;
};

std::int64_t trigger_now_ns = 42;

struct Triggered {
  void handle(const std::string& datagram, const std::string& sender = "192.168.1.5") {
    trigger.handle(datagram, sender);
  }
  TakeKeeper daemon;
  Trigger trigger{daemon, []() noexcept { return trigger_now_ns; }};
};

}  // namespace

TEST_CASE("a trigger's children may come in any order, among others, with the usual wrapping") {
  const auto message =
      parse_trigger(std::string("\n") +
                    start_text("<PacketID VALUE=\"17\"/><Assets><Asset VALUE=\"x\"/></Assets>"
                               "<TimeCode VALUE=\"01:02:03:04\"/><Name VALUE=\"walk &amp; run\"/>"
                               "<Notes VALUE=\"n\"/><Description VALUE=\"d\"/><Delay VALUE=\"33\"/>"
                               "<SessionName VALUE=\"s\"/>") +
                    std::string(" \r\n\0", 4));
  if (!message) FAIL(message.error().message);
  CHECK(message->start);
  CHECK(message->name == "walk & run");
  CHECK(message->notes == "n");
  CHECK(message->description == "d");
  CHECK(message->session == "s");
  CHECK(message->delay == "33");
  CHECK(message->packet_id == "17");
  CHECK(message->timecode == "01:02:03:04");
  const auto stop =
      parse_trigger("\xEF\xBB\xBF<CaptureStop RESULT=\"CANCEL\"><Name VALUE=\"a\"/></CaptureStop>");
  REQUIRE(stop);
  CHECK_FALSE(stop->start);
  CHECK(stop->result == "CANCEL");
  CHECK(parse_trigger(start_text("<TimeCode VALUE=\"now\"/>"))->timecode.empty());
}

TEST_CASE("a trigger that is not one whole element without entities is refused with its reason") {
  CHECK(has(trigger_error(""), "not XML"));
  CHECK(has(trigger_error("<CaptureStart><Name VALUE=\"a\" <Notes/></CaptureStart>"), "not XML"));
  CHECK(has(trigger_error("<CaptureStart>"), "not XML"));
  CHECK(has(trigger_error("<Capture/>"), "'Capture' instead of CaptureStart"));
  CHECK(has(trigger_error("<CaptureStart/><CaptureStop/>"), "beside its one element"));
  CHECK(has(trigger_error("<CaptureStart/>text"), "beside its one element"));
  CHECK(has(trigger_error("<!DOCTYPE a [<!ENTITY b \"c\">]><CaptureStart/>"), "document type"));
  CHECK(has(trigger_error("<CaptureStart><!-- --></CaptureStart>"), "comment"));
  CHECK(has(trigger_error(std::string("<Capture\0Start/>", 16)), "zero"));
  CHECK(has(trigger_error(start_text("<Name VALUE=\"a\"/><Name VALUE=\"b\"/>")),
            "two elements Name"));
  CHECK(has(trigger_error(start_text("<PacketID VALUE=\"1x\"/>")), "'1x' is not a number"));
  CHECK(has(trigger_error(start_text("<PacketID VALUE=\"" + std::string(20, '1') + "\"/>")),
            "number"));
  CHECK(has(trigger_error(std::string(kMaxTrigger + 1, ' ')), "8 KB"));
  std::string deep = "<CaptureStart>";
  while (deep.size() < kMaxTrigger - 3) deep += "<a>";
  CHECK(has(trigger_error(deep), "not XML"));
}

TEST_CASE("a trigger begins and ends takes, each command once") {
  Triggered triggered;
  const std::string start = start_text(
      "<Name VALUE=\"walk\"/><TimeCode VALUE=\"01:02:03:04\"/><Delay VALUE=\"500\"/>"
      "<PacketID VALUE=\"1\"/>");
  triggered.handle(start);
  triggered.handle(start);
  REQUIRE(triggered.daemon.marks.size() == 1);
  CHECK(triggered.trigger.repeated() == 1);
  const pipeline::TakeMark& begun = triggered.daemon.marks[0];
  CHECK(begun.start);
  CHECK(begun.name == "walk");
  CHECK(begun.timecode == "01:02:03:04");
  CHECK(begun.time_ns == 42);
  CHECK(begun.remark == "triggered by 192.168.1.5, its delay '500' (ms) is not waited for");
  triggered.handle(start, "192.168.1.6");  // another sender counts for itself
  CHECK(triggered.daemon.marks.size() == 2);
  const std::string stop =
      "<CaptureStop RESULT=\"FAIL\"><Name VALUE=\"walk\"/><PacketID VALUE=\"1\"/></CaptureStop>";
  triggered.handle(stop);
  REQUIRE(triggered.daemon.marks.size() == 3);
  CHECK_FALSE(triggered.daemon.marks[2].start);
  CHECK(triggered.daemon.marks[2].name.empty());
  CHECK(has(triggered.daemon.marks[2].remark, "result 'FAIL'"));
  CHECK(triggered.trigger.marked() == 3);
  triggered.handle("rubbish");
  triggered.daemon.recording = false;
  triggered.handle(start_text(""));
  CHECK(triggered.trigger.refused() == 2);
}

TEST_CASE("a trigger's name is made printable and short rather than refused") {
  Triggered triggered;
  triggered.handle(start_text("<Name VALUE=\"a&#27;[2J" + std::string(300, 'x') + "\"/>"));
  REQUIRE(triggered.daemon.marks.size() == 1);
  const std::string& name = triggered.daemon.marks[0].name;
  CHECK(name.starts_with("a\\x1b[2Jxx"));
  CHECK(name.size() <= pipeline::kMaxTakeName);
}

TEST_CASE("a flood of triggers begins few takes, and the next one by hand begins again") {
  Triggered triggered;
  const auto start = [&](int number) {
    triggered.handle(
        start_text("<Name VALUE=\"a\"/><PacketID VALUE=\"" + std::to_string(number) + "\"/>"));
  };
  for (int i = 0; i < 100; ++i) start(i);
  CHECK(triggered.daemon.marks.size() == Trigger::kAtOnce);
  CHECK(triggered.trigger.refused() == 100 - Trigger::kAtOnce);
  const std::size_t before = triggered.daemon.marks.size();
  trigger_now_ns += Trigger::kStartEvery_ns;
  start(100);
  CHECK(triggered.daemon.marks.size() == before + 1);
}

}  // namespace posed::control
