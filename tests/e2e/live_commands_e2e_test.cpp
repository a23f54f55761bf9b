// The live commands report the true state: of a daemon that died, of what changed and since when,
// of a replay, of the file that was written, and of what they wait for.
#include <catch2/catch.hpp>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/emulated_glove.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

std::string line_with(Process& process, const std::string& part) {
  while (auto line = process.line()) {
    if (line->contains(part)) return *line;
  }
  return {};
}

// The text of the next event that contains this; `events` prints JSON.
std::string event_with(Process& events, const std::string& part) {
  while (const auto line = events.line()) {
    const std::string text = json::parse(*line).at("text");
    if (text.contains(part)) return text;
  }
  return {};
}

constexpr const char* kNobody = "tcp://127.0.0.1:9";

TEST_CASE("monitor prints a glove's loss and return, and continues") {
  Stage stage;
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                       "[[stream]]\nname = \"right\"\ndriver = \"lucidgloves\"\n"
                                       "port = \"" +
                                       stage.path("right") + "\"\nhand = \"right\"\n");
  stage.launch("run");
  Process monitor({"monitor", "--connect", stage.publish, "--topic", "event"});
  for (int i = 0; i < 2; ++i) {
    EmulatedGlove glove(stage.path("right"), {"--set", "hand=right"});
    CHECK(has(line_with(monitor, " found "), "right"));
    glove.pull();
    CHECK(has(line_with(monitor, " lost "), "right"));
  }
  monitor.send(SIGINT);
  CHECK(monitor.exit_code() == 0);
}

TEST_CASE("a daemon that is gone is not shown as live") {
  Served served;
  served.start();
  Process top({"top", "--connect", served.publish});
  Process monitor({"monitor", "--connect", served.publish, "--topic", "stats"});
  Process waiting({"monitor", "--connect", served.publish, "--topic", "event", "--timeout", "4"});
  REQUIRE(top.line());
  REQUIRE(monitor.line());
  served.daemon->send(SIGSTOP);
  CHECK(monitor.comes_to_say("stopped or stuck"));
  CHECK(waiting.exit_code() == 1);
  CHECK(has(waiting.errors(), "after 4 s (--timeout)"));
  served.daemon->send(SIGCONT);
  CHECK(monitor.comes_to_say("answers again, after "));
  served.daemon->send(SIGKILL);
  for (const Process* one : {&top, &monitor}) {
    INFO(one->errors());
    CHECK(one->comes_to_say("posed: " + served.publish + ": no answer for "));
    CHECK(one->comes_to_say("ended, or cannot be reached"));
  }
  for (Process* one : {&top, &monitor}) {
    one->send(SIGTERM);
    CHECK(one->exit_code() == 0);
  }
}

TEST_CASE("monitor gives up a stream that does not come") {
  Served served("[[stream]]\nname = \"right\"\ndriver = \"cyberglove\"\nport = \"/dev/none\"\n");
  served.start();
  const auto late =
      posed({"monitor", "--connect", served.publish, "--stream", "right", "--timeout", "2"});
  CHECK(late.code == 1);
  CHECK(has(late.err, "pose/right ... 2 s (--timeout)"));
  const auto there = posed({"monitor", "--connect", served.publish, "--stream", "walker", "--count",
                            "700", "--timeout", "5"});  // longer than that
  CHECK(there.code == 0);
}

TEST_CASE("commands that wait for a daemon report what they wait for") {
  for (const char* command : {"top", "monitor"}) {
    Process waits({command, "--connect", kNobody, "--json"});
    CHECK(waits.comes_to_say("posed: waiting ... tcp://127.0.0.1:9"));
    waits.send(SIGINT);
    CHECK(waits.exit_code() == 0);
    const ProgramOutcome gives_up =
        posed({command, "--connect", kNobody, "--count", "1", "--timeout", "2"});
    CHECK(gives_up.code == 1);
    CHECK(has(gives_up.err, "gave up after 2 s"));
  }
  const ProgramOutcome ctl = posed({"ctl", "--connect", kNobody, "--timeout", "0.3", "status"});
  CHECK(ctl.code == 1);
  CHECK(has(ctl.err, "waited 0.3 s"));
  CHECK(has(ctl.err, "a replay ... no control"));
}

TEST_CASE("a status is as new as the acknowledgement before it, and events say what changed") {
  Served served;
  served.start();
  Process events({"monitor", "--connect", served.publish, "--topic", "event", "--json"});
  Process all({"monitor", "--connect", served.publish, "--topic", "stats"});
  REQUIRE(all.line());  // subscriptions take a moment; this one was made last
  const auto stream = [&] {
    return json::parse(served.ctl({"--json", "status"}).out).at("status").at("stream").at(0);
  };
  for (const double alpha : {0.5, -0.25, 1.5, 0.0}) {
    const ProgramOutcome set = served.ctl({"set", "walker", "alpha", std::to_string(alpha)});
    REQUIRE(set.code == 0);
    CHECK(has(set.out, ": alpha "));
    CHECK(stream().at("alphaTarget") == alpha);
  }
  CHECK(event_with(events, "style.alpha 1 -> 0.5 from frame ") != "");
  CHECK(event_with(events, "style.alpha 0.5 -> -0.25 from frame ") != "");
  const std::uint64_t before = std::stoull(stream().at("frames").get<std::string>());
  for (const char* model : {"two.style", "one.style", "two.style"}) {
    REQUIRE(served.ctl({"model", "walker", served.path(model)}).code == 0);
    CHECK(stream().at("model") == model);
  }
  CHECK(event_with(events, "style model one.style -> two.style from frame ") != "");
  CHECK(std::stoull(stream().at("frames").get<std::string>()) > before);
}

TEST_CASE("a published replay is marked as one, and its times are consistent") {
  const TempFolder folder;
  const auto log = (folder.path() / "staged.plog").string();
  std::filesystem::copy_file(golden("replay/staged.plog"), log);
  Process replay({"replay", log, "--speed", "0.1", "--publish", "--endpoint", "tcp://127.0.0.1:*"});
  const auto line = replay.line();
  INFO(replay.errors());
  REQUIRE(line);
  const json ready = json::parse(*line);
  CHECK(ready.at("replay") == log);
  const std::string endpoint = ready.at("publish");

  Process stats({"monitor", "--connect", endpoint, "--topic", "stats", "--json"});
  const ProgramOutcome frames =
      posed({"monitor", "--connect", endpoint, "--json", "--count", "10"});
  REQUIRE(frames.code == 0);
  const json frame = json::parse(frames.out.substr(0, frames.out.find('\n')));
  const auto ns = [](const json& value) { return std::stoll(value.get<std::string>()); };
  const double age_s = seconds(ns(frame.at("publishedNs")) - ns(frame.at("arrivalNs")));
  CHECK(age_s >= 0.0);
  CHECK(age_s < 1.0);
  bool live = false;
  while (const auto text = stats.line()) {
    const json one = json::parse(*text);
    CHECK(one.at("replayFile") == "staged.plog");
    for (const json& stream : one.at("stream")) {
      live = live || stream.at("state") == "live";
      CHECK(stream.at("publish").at("maxUs").get<double>() < 1e6);
    }
    if (live) break;
  }
  CHECK(live);
  const std::string words = "staged.plog, 0.1 x ... recording's";
  CHECK(stats.comes_to_say(words));
  replay.send(SIGINT);
  CHECK(replay.exit_code() == 0);

  const ProgramOutcome unreceived = posed({"replay", log, "--endpoint", "tcp://127.0.0.1:*"});
  CHECK(unreceived.code == 2);
  CHECK(has(unreceived.err, "--publish"));
  Process cut({"replay", log, "--speed", "0.05", "--out", (folder.path() / "cut").string()});
  CHECK(cut.comes_to_say("replayed 0 of "));  // its progress
  cut.send(SIGINT);
  CHECK(cut.exit_code() == 1);
  CHECK(has(cut.errors(), "was not written"));
  CHECK_FALSE(std::filesystem::exists(folder.path() / "cut"));
}

TEST_CASE("a recording ends with what was written") {
  Served served;
  served.launch("record", {"--out", served.path("take.plog"), "--json"});
  served.await_frames("walker", 80);
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
  const auto line = served.daemon->line();
  REQUIRE(line);
  const json summary = json::parse(*line);
  CHECK(summary.at("file") == served.path("take.plog"));
  CHECK(summary.at("bytes") == std::filesystem::file_size(served.path("take.plog")));
  CHECK(summary.at("frames") > 10);
  CHECK(summary.at("streams").at(0).at("stream") == "walker");
  CHECK(summary.at("missing_chunks") == 0);
  CHECK(summary.at("missing_frames") == 0);
  CHECK(summary.at("seconds") >= 0.5);
  CHECK(has(served.daemon->errors(), "take.plog: "));
  CHECK(has(served.daemon->errors(), "nothing is missing"));
}

TEST_CASE("ctl checks a file before it sends it") {
  Served served;
  served.start();
  const auto fit =
      served.folder.write("ann.toml",
                          "format = 1\ndriver = \"lucidgloves\"\nhand = \"right\"\n[sensors]\n"
                          "index_joint1 = [[0, 0.0], [2000, 1.0]]\n");
  const ProgramOutcome style = served.ctl({"calibrate", "walker", served.path("one.style")});
  CHECK(style.code == 1);
  CHECK(has(style.err, "one.style: ... not a glove's calibration ... `posed ctl model walker "));
  const ProgramOutcome toml = served.ctl({"model", "walker", fit.string()});
  CHECK(toml.code == 1);
  CHECK(has(toml.err, "ann.toml: ... not a model ... `posed ctl calibrate walker "));
  CHECK(has(served.ctl({"model", "walker", served.path("walk.bvh")}).err, "is a clip"));
  const ProgramOutcome broken = served.ctl(
      {"calibrate", "walker", served.folder.write("half.toml", "format = 1\ndriver = ").string()});
  CHECK(broken.code != 0);
  CHECK(has(broken.err, "half.toml:2"));
  CHECK(served.ctl({"haptics", "walker"}).code == 2);
}

TEST_CASE("ctl says that a request is too long for any daemon") {
  Served served;
  served.start();
  std::string labels;
  while (labels.size() < 100'000) labels += "g 1 c 3 4 p ";
  const ProgramOutcome refused = served.ctl({"play", "walker", labels});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "bytes and may have 65536"));
}

TEST_CASE("a piped status has complete names, and no line ends in blanks") {
  Served served;
  const std::string name = "a-style-with-a-rather-long-name-that-was-cut-before.style";
  std::filesystem::copy_file(served.path("one.style"), served.path(name));
  served.start();
  REQUIRE(served.ctl({"model", "walker", served.path(name)}).code == 0);
  const ProgramOutcome status = served.ctl({"status"});
  CHECK(has(status.out, name + "\n"));
  CHECK_FALSE(status.out.contains(" \n"));
}

TEST_CASE("each command explains its own options, and refuses those without an effect") {
  const ProgramOutcome set = posed({"ctl", "set", "--help"});
  CHECK(set.code == 0);
  CHECK(has(set.out, "posed ctl set walker alpha 0.5"));
  CHECK_FALSE(set.out.contains("posed ctl haptics"));
  CHECK_FALSE(set.out.contains("posed ctl play"));
  const std::string help = posed({"top", "--help"}).out;
  for (const char* column : {"STATE ", "LATENCY ", "ALPHA ", "microseconds"})
    CHECK(has(help, column));
  CHECK(posed({"monitor", "--topic", "stats", "--stream", "walker"}).code == 2);
  CHECK(posed({"top", "--json", "--control", "tcp://127.0.0.1:5571"}).code == 2);
  CHECK(posed({"emulate", "lucidgloves", "--stream", "right"}).code == 2);
  CHECK(posed({"emulate", "lucidgloves", "--seed", "3", "--seconds", "1"}).code == 2);
  CHECK(posed({"run", "--config", "none.toml", "--seconds", "-1"}).code == 2);
  for (const auto& [device, way, advice] :
       {std::array{"cyberglove", "--udp", "give --link PATH or --tcp HOST:PORT"},
        std::array{"natnet", "--tcp", "give --udp IP:PORT"},
        std::array{"posed", "--udp", "give --publish ENDPOINT"}}) {
    const auto unreceived = posed({"emulate", device, way, "127.0.0.1:9", "--seconds", "0.1"});
    CHECK(unreceived.code == 2);
    CHECK(has(unreceived.err, std::string("posed does not listen for ") + device + " ... " + way));
    CHECK(has(unreceived.err, advice));
  }
  const auto mistyped = [](std::vector<std::string> words, const std::string& sentence) {
    const auto refused = posed(std::move(words));
    INFO(refused.err);
    return refused.code == 2 && has(refused.err, sentence);
  };
  CHECK(mistyped({"view", "--port", "99999"}, "--port: '99999' ... 0 to 65535"));
  CHECK(mistyped({"emulate", "cyberglove", "--fault", "drop:0.1", "--seed", "-1"},
                 "--seed: '-1' ... 0 or more"));
  CHECK(mistyped({"calibrate", "--driver", "cyberglove", "--user", "", "--out", "c.toml"},
                 "--user ... empty"));
  const auto missing = posed({"convert", "nope"});
  CHECK(missing.code == 1);
  CHECK(has(missing.err, "nope: is not there"));
  CHECK(has(posed({"emulate", "nope.plog"}).err, "nope.plog: is not there"));
  CHECK(mistyped({"run", "my.toml"}, "--config my.toml"));
  CHECK(mistyped({"monito"}, "'monito' ... monitor"));
  CHECK(mistyped({"ctl", "--connect", kNobody, "sett"}, "the nearest is set"));
  CHECK(mistyped({"train", "style", "--form", "a.bvh"}, "'--form' ... --from"));
  const TempFolder folder;
  const auto mine = folder.write("mine", "precious");
  const auto link = folder.path() / "link";
  std::filesystem::create_symlink(mine, link);
  const ProgramOutcome taken = posed({"emulate", "lucidgloves", "--link", link.string()});
  CHECK(taken.code == 2);
  CHECK(has(taken.err, "another name ... --link"));
  CHECK(std::filesystem::read_symlink(link) == mine);

  Served served;
  served.start();
  const ProgramOutcome misnamed =
      posed({"monitor", "--connect", served.publish, "--stream", "walkr"});
  CHECK(misnamed.code == 1);
  CHECK(has(misnamed.err, "'walkr' ... walker"));
  Process counting({"monitor", "--connect", served.publish, "--count", "100000"});
  REQUIRE(counting.line());
  counting.send(SIGINT);
  CHECK(counting.exit_code() == 1);
  CHECK(has(counting.errors(), "of 100000 messages"));
}

}  // namespace
}  // namespace posed::test
