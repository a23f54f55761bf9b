// Takes with the real binary: marked by ctl, cut by convert, and kept after kill -9.
#include <catch2/catch.hpp>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
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
  // Cuts the walker's take from the log as cut.bvh; without a take, all of it.
  [[nodiscard]] ProgramOutcome cut(const std::string& log, const std::string& take) const {
    std::vector<std::string> arguments{"convert",     log,     "--stream",     "walker",
                                       "--overwrite", "--out", path("cut.bvh")};
    if (!take.empty()) arguments.insert(arguments.end(), {"--take", take});
    return posed(std::move(arguments));
  }
  // The lines of its frames.
  [[nodiscard]] std::string frames_cut() const {
    const std::string text = file_text(path("cut.bvh"));
    return text.substr(text.find('\n', text.find("Frame Time")) + 1);
  }
  [[nodiscard]] std::string frames_of(const std::string& log, const std::string& take) const {
    const ProgramOutcome outcome = cut(log, take);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return frames_cut();
  }
};

json takes_of(const std::string& log) {
  const ProgramOutcome outcome = posed({"convert", log, "--takes", "--json"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return json::parse(outcome.out);
}

// A daemon that has written the clips of a first take, and of a second one writes them at its end:
// of streams fast enough that this takes a while.
class ClipTakes : public Takes {
 public:
  ClipTakes() {
    std::string text = std::string(kEndpoints) + "[record]\nclips = \"bvh\"\n";
    for (const char* name : {"walker", "b", "c", "d", "e", "f", "g", "h"}) {
      text += std::string("[[stream]]\nname = \"") + name + "\"\ndriver = \"file\"\n" +
              "[stream.file]\npath = \"walk.bvh\"\nloop = true\npace = 8.0\n" +
              "[stream.style]\nmodel = \"one.style\"\n";
    }
    folder.write("posed.toml", text);
    start();
    take({"start", "walk"});
    await_frames("walker", 200);
    take({"start", "run"});
    await_frames("walker", 2400);  // 2.5 s
    // Clips of a take are written in the order of the streams' names, so this one comes last.
    for (int i = 0; i < 600'000 && files("-1-walker.walk.bvh").empty(); ++i) {
      std::this_thread::sleep_for(1ms);
    }
    REQUIRE(files("-1-walker.walk.bvh").size() == 1);  // while the daemon runs
    CHECK(files("-2-walker.run.bvh").empty());
  }
  // The recording's files whose names end so, without the folder.
  [[nodiscard]] std::vector<std::string> files(const std::string& end) const {
    std::vector<std::string> found;
    for (const auto& file : std::filesystem::directory_iterator(path("takes"))) {
      const std::string name = file.path().filename().string();
      if (name.ends_with(end)) found.push_back(name);
    }
    return found;
  }
  // The log has both takes, and nothing is there beside it and whole clips of theirs.
  void check_whole(std::size_t clips) const {
    const auto logs = files(".plog");
    REQUIRE(logs.size() == 1);
    const std::string log = path("takes/" + logs[0]);
    const json takes = takes_of(log);
    REQUIRE(takes.size() == 2);
    CHECK(takes[0].at("ended") == true);
    CHECK(frames_of(log, "run").size() > 10'000);
    CHECK(files(".bvh").size() == clips);
    CHECK(files("").size() == 1 + clips);
    for (const auto& [take, name] :
         std::map<std::string, std::string>{{"-1", "walk"}, {"-2", "run"}}) {
      for (const std::string& clip : files(take + "-walker." + name + ".bvh")) {
        CHECK(file_text(path("takes/" + clip)).ends_with(frames_of(log, name)));
      }
    }
  }
};

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
  stage.await_frames("walker", 40);
  stage.take({"start"});  // ends the first
  stage.await_frames("walker", 40);
  stage.take({"stop"});
  CHECK_FALSE(json::parse(stage.ctl({"--json", "status"}).out).at("status").contains("take"));
  CHECK(stage.ctl({"take", "start", std::string(129, 'x')}).code == 1);
  stage.await_frames("walker", 20);
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
  CHECK(has(unknown.err, "'run' ... take 1 'walk', take 2"));
  const ProgramOutcome replay = posed({"replay", log, "--speed", "max", "--expect", "--json"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

TEST_CASE("a daemon killed during a take leaves a log whose take can be cut") {
  Takes stage;
  stage.record();
  stage.await_frames("walker", 40);
  stage.take({"start", "walk"});
  const std::string log = stage.path("take.plog");
  // What is read while the daemon writes is committed: frames of the take are, so it may die.
  const auto committed = [&] {
    const ProgramOutcome cut = stage.cut(log, "walk");
    return cut.code == 0 && stage.frames_cut().size() > 1000;
  };
  for (int i = 0; i < 100 && !committed(); ++i) std::this_thread::sleep_for(100ms);
  stage.daemon->send(SIGKILL);
  CHECK(stage.daemon->exit_code() == 128 + SIGKILL);
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
  CHECK(has(refused.err, "not recording ... `posed record` ... [record]"));
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  stage.write_config("[record]\nclips = \"bvh\"\n");
  stage.start();
  stage.take({"start", "walk"});
  stage.await_frames("walker", 30);
  stage.take({"stop"});
  stage.take({"start", "run"});
  stage.await_frames("walker", 30);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  std::string log;
  for (const auto& file : std::filesystem::directory_iterator(stage.path("takes"))) {
    if (file.path().extension() == ".plog") log = file.path().string();
  }
  REQUIRE(log.ends_with("Z.plog"));
  CHECK(takes_of(log).size() == 2);
  const std::string stem = log.substr(0, log.size() - std::string(".plog").size());
  for (const std::string take : {"1-walker.walk", "2-walker.run"}) {
    const std::string clip = file_text(stem + "-" + take + ".bvh");
    CHECK(clip.ends_with(stage.frames_of(log, take.substr(0, 1))));
  }
}

TEST_CASE("daemons that begin at once with one folder each have a whole log") {
  constexpr int kDaemons = 4;
  Takes stage;
  stage.write_config("[record]\nframes = true\n");
  std::vector<std::unique_ptr<Process>> daemons;
  for (int i = 0; i < kDaemons; ++i) {
    daemons.push_back(std::make_unique<Process>(
        std::vector<std::string>{"run", "--config", stage.path("posed.toml")}));
  }
  std::set<std::string> files;
  for (const auto& daemon : daemons) {
    const auto line = daemon->line();
    INFO(daemon->errors());
    REQUIRE(line);
    const json ready = json::parse(*line);
    CHECK(posed({"monitor", "--connect", ready.at("publish"), "--count", "20"}).code == 0);
    const ProgramOutcome status =
        posed({"ctl", "--connect", ready.at("control"), "status", "--json"});
    REQUIRE(status.code == 0);
    const json stats = json::parse(status.out).at("status");
    CHECK(stats.value("recorderErrors", "0") == "0");
    files.insert(stats.at("recorderFile"));
  }
  CHECK(files.size() == kDaemons);
  for (const auto& daemon : daemons) {
    daemon->send(SIGTERM);
    CHECK(daemon->exit_code() == 0);
  }
  for (const std::string& file : files) {
    const ProgramOutcome replay = posed({"replay", file, "--speed", "max", "--expect"});
    INFO(replay.err);
    CHECK(replay.code == 0);
  }
  for (const auto& file : std::filesystem::directory_iterator(stage.path("takes"))) {
    CHECK(file.path().extension() == ".plog");
  }
}

TEST_CASE("a signal that already waits when clips of takes would be written leaves no more") {
  ClipTakes stage;
  stage.daemon->send(SIGSTOP);  // so that the daemon gets both at once
  stage.daemon->send(SIGINT);
  stage.daemon->send(SIGTERM);
  stage.daemon->send(SIGCONT);
  CHECK(stage.daemon->exit_code() == 1);
  CHECK(has(stage.daemon->errors(), "interrupted: ... log is complete"));
  stage.check_whole(8);
}

TEST_CASE("a second SIGINT while clips of takes are written leaves the log and whole clips") {
  ClipTakes stage;
  stage.daemon->send(SIGINT);
  std::this_thread::sleep_for(100ms);
  stage.daemon->send(SIGINT);
  // Some of the second take's clips may have been written before the signal; on a machine that
  // stalls the test here, all of them.
  const bool interrupted = stage.daemon->exit_code() == 1;
  CHECK(has(stage.daemon->errors(), "interrupted: ... log is complete") == interrupted);
  const std::size_t clips = stage.files(".bvh").size();
  CHECK(clips >= 8);
  CHECK((clips < 16) == interrupted);
  stage.check_whole(clips);
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
  stage.await_frames("walker", 30);
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
  CHECK(takes[0].at("timecode") == "10:20:30:05");
  const auto from = [&stage](const std::string& timecode) {
    return posed({"convert", stage.path("take.plog"), "--stream", "walker", "--take", "1", "--from",
                  timecode, "--out", stage.path("part.glb"), "--overwrite", "--json"});
  };
  const auto frames = [&from](const std::string& timecode) {
    return json::parse(from(timecode).out).at("frames").get<int>();
  };
  const int all = frames("10:20:30:05@25");
  CHECK(frames("10:20:30:07@25") < all);
  CHECK(has(from("10:20:30:07").err, "say how many frames a second has"));
  CHECK(has(from("12:00:00:00@25").err, "has no frame"));
}

}  // namespace posed::test
