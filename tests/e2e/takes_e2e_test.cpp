// Takes with the real binary: marked by ctl, cut by convert, and kept after kill -9.
#include <catch2/catch.hpp>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "drivers/transport/address.hpp"
#include "tests/e2e/events.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/free_port.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

class Takes : public Served {
 public:
  void take(std::vector<std::string> what) const {
    what.insert(what.begin(), "take");
    const ProgramOutcome outcome = ctl(std::move(what));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  }
  // The lines of a clip's frames.
  [[nodiscard]] std::string frames_of(const std::string& log, const std::string& take) const {
    const std::string out = path("cut.bvh");
    std::vector<std::string> arguments{"convert", log, "--stream",   "walker",
                                       "--out",   out, "--overwrite"};
    if (!take.empty()) arguments.insert(arguments.end(), {"--take", take});
    const ProgramOutcome outcome = posed(std::move(arguments));
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const std::string text = file_text(out);
    return text.substr(text.find('\n', text.find("Frame Time")) + 1);
  }
};

json takes_of(const std::string& log) {
  const ProgramOutcome outcome = posed({"convert", log, "--takes", "--json"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return json::parse(outcome.out);
}

}  // namespace

TEST_CASE("takes marked by ctl are intervals of the whole clip, and replay is as without them") {
  Takes stage;
  stage.record();
  Process events({"monitor", "--connect", stage.publish, "--topic", "event", "--json"});
  std::this_thread::sleep_for(300ms);
  CHECK(stage.ctl({"take", "stop"}).code == 1);  // none runs
  stage.take({"start", "walk"});
  wait_for(events, "KIND_TAKE");
  const ProgramOutcome status = stage.ctl({"--json", "status"});
  CHECK(json::parse(status.out).at("status").at("take").at("name") == "walk");
  std::this_thread::sleep_for(400ms);
  stage.take({"start"});  // ends the first
  std::this_thread::sleep_for(300ms);
  stage.take({"stop"});
  CHECK_FALSE(json::parse(stage.ctl({"--json", "status"}).out).at("status").contains("take"));
  CHECK(stage.ctl({"take", "start", std::string(129, 'x')}).code == 1);
  std::this_thread::sleep_for(200ms);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);

  const std::string log = stage.path("take.plog");
  const json takes = takes_of(log);
  REQUIRE(takes.size() == 2);
  CHECK(takes[0].at("name") == "walk");
  CHECK(takes[0].at("last_item").get<int>() + 1 == takes[1].at("first_item").get<int>());
  const std::string whole = stage.frames_of(log, "");
  const std::string first = stage.frames_of(log, "walk");
  const std::string second = stage.frames_of(log, "2");
  CHECK(first.size() > 1000);
  CHECK(second.size() > 1000);
  CHECK(first.size() + second.size() < whole.size());
  CHECK(has(whole, first + second));
  const ProgramOutcome unknown =
      posed({"convert", log, "--take", "run", "--out", stage.path("no.bvh")});
  CHECK(unknown.code == 2);
  CHECK(has(unknown.err, "has no take 'run', but take 1 'walk', take 2"));
  const ProgramOutcome replay = posed({"replay", log, "--speed", "max", "--expect", "--json"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

TEST_CASE("a daemon killed during a take leaves a log whose take can be cut") {
  Takes stage;
  stage.record();
  std::this_thread::sleep_for(300ms);
  stage.take({"start", "walk"});
  std::this_thread::sleep_for(1200ms);  // commits take at most 0.5 s
  stage.daemon->send(SIGKILL);
  CHECK(stage.daemon->exit_code() == 128 + SIGKILL);
  const std::string log = stage.path("take.plog");
  const json takes = takes_of(log);
  REQUIRE(takes.size() == 1);
  CHECK(takes[0].at("ended") == false);
  const std::string whole = stage.frames_of(log, "");
  const std::string cut = stage.frames_of(log, "walk");
  CHECK(cut.size() > 1000);
  CHECK(cut.size() < whole.size());
  CHECK(whole.ends_with(cut));
}

TEST_CASE("a [record] table makes `run` record into a folder, and without one takes are refused") {
  Takes stage;
  stage.start();
  const ProgramOutcome refused = stage.ctl({"take", "start"});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "is not recording; start it with `posed record` or a [record] table"));
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  stage.write_config("[record]\nclips = \"bvh\"\n");
  stage.start();
  stage.take({"start", "walk"});
  std::this_thread::sleep_for(300ms);
  stage.take({"stop"});
  stage.take({"start", "run"});
  std::this_thread::sleep_for(300ms);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  std::string log;
  for (const auto& file : std::filesystem::directory_iterator(stage.path("takes"))) {
    if (file.path().extension() == ".plog") log = file.path().string();
  }
  REQUIRE(log.ends_with("Z.plog"));
  CHECK(takes_of(log).size() == 2);
  const std::string stem = log.substr(0, log.size() - std::string(".plog").size());
  for (const std::string take : {"1", "2"}) {
    const std::string clip = file_text(stem + "-" + take + "-walker.bvh");
    CHECK(clip.ends_with(stage.frames_of(log, take)));
  }
}

TEST_CASE("datagrams of a capture system mark takes, once each, and rubbish marks none") {
  Takes stage;
  const std::string port = std::to_string(free_port());
  stage.write_config("[trigger]\nlisten = \"127.0.0.1:" + port + "\"\n");
  stage.record();
  const int sender = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto address = drivers::parse_endpoint("127.0.0.1:" + port);
  REQUIRE(address);
  const auto send = [&](const std::string& datagram) {
    CHECK(::sendto(sender, datagram.data(), datagram.size(), 0, address->get(), address->size) ==
          static_cast<ssize_t>(datagram.size()));
  };
  const std::string start =
      "<CaptureStart><Name VALUE=\"walk\"/><TimeCode VALUE=\"10:20:30:05\"/>"
      "<PacketID VALUE=\"7\"/></CaptureStart>";
  Process events({"monitor", "--connect", stage.publish, "--topic", "event", "--json"});
  std::this_thread::sleep_for(300ms);
  send("<!DOCTYPE x><CaptureStart/>");
  send(start + std::string(1, '\0'));
  send(start);  // the same command again
  wait_for(events, "KIND_TAKE");
  const json take = json::parse(stage.ctl({"--json", "status"}).out).at("status").at("take");
  CHECK(take.at("number") == 1);
  CHECK(take.at("name") == "walk");
  CHECK(take.at("timecode") == "10:20:30:05");
  std::this_thread::sleep_for(300ms);
  send(
      "<CaptureStop RESULT=\"CANCEL\"><Name VALUE=\"walk\"/><PacketID VALUE=\"8\"/>"
      "</CaptureStop>");
  wait_for(events, "KIND_TAKE");
  ::close(sender);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  CHECK(has(stage.daemon->errors(), "document type"));
  CHECK(has(stage.daemon->errors(), "result 'CANCEL'"));
  const json takes = takes_of(stage.path("take.plog"));
  REQUIRE(takes.size() == 1);
  CHECK(takes[0].at("ended") == true);
  CHECK(stage.frames_of(stage.path("take.plog"), "walk").size() > 1000);
}

}  // namespace posed::test
