// Recorder and replay with the real binary: stopped, overloaded and killed.
#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include <netinet/in.h>
#include <sched.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/log/reader.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/mocap_room.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

// Two walkers with a style, and everything `posed record` needs for them.
class Walkers : public Stage {
 public:
  Walkers() {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    REQUIRE(style::save_model(toy_model(1), folder.path() / "one.style"));
    REQUIRE(style::save_model(toy_model(2), folder.path() / "two.style"));
    std::string config = kEndpoints;
    for (const char* name : {"walker", "other"}) {
      config += std::string("[[stream]]\nname = \"") + name +
                "\"\ndriver = \"file\"\npublish_raw = true\n"
                "[stream.file]\npath = \"walk.bvh\"\n[stream.style]\nmodel = \"one.style\"\n";
    }
    folder.write("posed.toml", config);
  }

  void notify(std::vector<std::string> what) const {
    const ProgramOutcome outcome = ctl(std::move(what));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
  }

  // The reader and the pipeline share one processor and the pipeline has lower priority: after a
  // stop, the reader decodes everything that is due before the pipeline handles the first frame.
  void hold_back_pipeline(bool hold) const {
    const auto tasks = "/proc/" + std::to_string(daemon->pid()) + "/task";
    for (const auto& task : std::filesystem::directory_iterator(tasks)) {
      std::string name;
      std::ifstream(task.path() / "comm") >> name;
      const auto id = static_cast<pid_t>(std::stol(task.path().filename().string()));
      if (name != "posed-reader" && name != "posed-pipeline") continue;
      cpu_set_t cpus;
      CPU_ZERO(&cpus);
      CPU_SET(0, &cpus);
      sched_setaffinity(id, sizeof cpus, &cpus);
      const sched_param none{};
      if (name == "posed-pipeline") {
        REQUIRE(sched_setscheduler(id, hold ? SCHED_IDLE : SCHED_OTHER, &none) == 0);
      }
    }
  }

  [[nodiscard]] std::set<std::string> decisions() const {
    const auto reader = log::Reader::open(path("take.plog"));
    REQUIRE(reader);
    const auto rows = reader->decisions();
    REQUIRE(rows);
    std::set<std::string> names;
    for (const auto& row : *rows) names.insert(row.name);
    return names;
  }
};

}  // namespace

TEST_CASE("replays of alpha and model changes and a forced shed give one FRAMES.bin as published") {
  Walkers stage;
  stage.record();
  stage.notify({"set", "walker", "alpha", "-0.5"});
  stage.notify({"model", "other", stage.path("two.style")});
  stage.hold_back_pipeline(true);
  for (int i = 0; i < 10 && !stage.decisions().contains("shed"); ++i) {
    stage.daemon->send(SIGSTOP);
    std::this_thread::sleep_for(700ms);
    stage.daemon->send(SIGCONT);
    std::this_thread::sleep_for(800ms);  // a log may be read while it is written
  }
  stage.hold_back_pipeline(false);
  stage.notify({"set", "other", "alpha", "0.25"});
  std::this_thread::sleep_for(300ms);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  for (const char* name : {"alpha", "model", "shed"}) CHECK(stage.decisions().contains(name));

  const std::string log = stage.path("take.plog");
  for (const char* name : {"one.bin", "two.bin"}) {
    const ProgramOutcome replay =
        posed({"replay", log, "--speed", "max", "--out", stage.path(name), "--expect", "--json"});
    INFO(replay.err);
    REQUIRE(replay.code == 0);
    const json counts = json::parse(replay.out);
    CHECK(counts.at("compared") == counts.at("frames"));
    CHECK(counts.at("raw_frames") > 0);
    CHECK(counts.at("raw_frames") < counts.at("frames"));
    // The number depends on how much a busy machine sheds; a recording of seconds has hundreds.
    CHECK(counts.at("compared") > 100);
  }
  CHECK(!file_text(stage.path("one.bin")).empty());
  CHECK(file_text(stage.path("one.bin")) == file_text(stage.path("two.bin")));
}

// How much is missing is judged on the virtual clock: world_property_test.
TEST_CASE("kill -9 leaves a log that has what was committed and replays") {
  for (const auto life : {900ms, 1050ms, 1200ms}) {
    Walkers stage;
    stage.record();
    await_commit(stage.path("take.plog"));
    std::this_thread::sleep_for(life);
    stage.daemon->send(SIGKILL);
    CHECK(stage.daemon->exit_code() == 128 + SIGKILL);
    const ProgramOutcome replay =
        posed({"replay", stage.path("take.plog"), "--speed", "max", "--expect", "--json"});
    INFO(replay.err);
    REQUIRE(replay.code == 0);
    CHECK(json::parse(replay.out).at("compared") > 20);
  }
}

TEST_CASE("record and replay refuse wrong use with one error message") {
  Walkers stage;
  stage.folder.write("take.plog", "not a log, but somebody's");
  const ProgramOutcome kept =
      posed({"record", "--config", stage.path("posed.toml"), "--out", stage.path("take.plog")});
  CHECK(kept.code == 2);
  CHECK(kept.err.find("take.plog: exists already") != std::string::npos);
  const ProgramOutcome foreign = posed({"replay", stage.path("take.plog")});
  CHECK(foreign.code == 1);
  CHECK(foreign.err.find("take.plog: not a device log") != std::string::npos);
  CHECK(posed({"replay", stage.path("none.plog")}).code == 1);
  CHECK(posed({"replay", stage.path("take.plog"), "--speed", "fast"}).code == 2);
  const ProgramOutcome nowhere =
      posed({"record", "--config", stage.path("posed.toml"), "--out", stage.path("no/take.plog")});
  CHECK(nowhere.code == 2);
  CHECK(nowhere.err.find("its folder is not there") != std::string::npos);
  const ProgramOutcome own = posed({"record", "--config", stage.path("posed.toml"), "--out",
                                    stage.path("one.style"), "--overwrite"});
  CHECK(own.code == 2);
  CHECK(style::load_model(stage.path("one.style")));
}

TEST_CASE("record counts people who have left, and names a source that no body came from") {
  Stage stage;
  const std::uint16_t port = free_port();
  std::string config = Stage::kEndpoints;
  for (const auto& [name, its] : {std::pair{"room", port}, std::pair{"empty", free_port()}}) {
    config += "[[source]]\nname = \"" + std::string(name) +
              "\"\ndriver = \"template_mocap\"\nstreams = \"all\"\n"
              "[source.template_mocap]\nlisten = \"127.0.0.1:" +
              std::to_string(its) + "\"\n";
  }
  stage.folder.write("posed.toml", config);
  stage.launch("record", {"--out", stage.path("take.plog"), "--frames", "--json"});
  MocapRoom room(port);
  for (int frame = 0; frame < 300; ++frame) {
    if (frame % 60 == 0) room.change();
    room.frame();
    std::this_thread::sleep_for(10ms);
  }
  stage.daemon->send(SIGTERM);
  const json summary = json::parse(stage.daemon->line().value());
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::string errors = stage.daemon->errors();
  INFO(errors);
  std::uint64_t there = 0, recorded = 0;
  for (const json& stream : summary.at("streams")) there += stream.at("frames").get<int>();
  CHECK(summary.at("left_frames") > 0);
  CHECK(summary.at("frames") == there + summary.at("left_frames").get<std::uint64_t>());
  const auto log = log::Reader::open(stage.path("take.plog"));
  REQUIRE(log);
  for (const log::StreamRow& stream : log->streams()) {
    auto frames = log->frames(stream.id, false);
    REQUIRE(frames);
    for (auto row = frames->next(); row && *row; row = frames->next()) ++recorded;
  }
  CHECK(summary.at("frames") == recorded);
  CHECK(errors.find("streams and those that have left, ") != std::string::npos);
  CHECK(errors.find("MB of memory are set aside") != std::string::npos);

  const ProgramOutcome replay =
      posed({"replay", stage.path("take.plog"), "--speed", "max", "--expect"});
  CHECK(replay.code == 0);
  for (const std::string& text : {errors, replay.err}) {
    INFO(text);
    CHECK(text.find("source 'empty' named no body that became a stream") != std::string::npos);
    CHECK(text.find("source 'room' named no body") == std::string::npos);
  }
}

TEST_CASE("rubbish in large datagrams fills a log slowly, and the device beside it is recorded") {
  Stage stage;
  const std::uint16_t port = free_port();
  stage.folder.write("posed.toml",
                     std::string(Stage::kEndpoints) +
                         "[[source]]\nname = \"room\"\ndriver = \"template_mocap\"\n"
                         "streams = \"all\"\n[source.template_mocap]\nlisten = \"127.0.0.1:" +
                         std::to_string(port) + "\"\n");
  stage.record();
  const auto start = std::chrono::steady_clock::now();
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(port);
  const std::string rubbish(60'000, 'r');
  MocapRoom room(port);
  std::uint64_t sent = 0;
  for (int frame = 0; frame < 300; ++frame) {
    if (frame % 30 == 0) room.describe();
    for (int i = 0; i < 4; ++i) {
      sent += ::sendto(fd, rubbish.data(), rubbish.size(), 0,
                       reinterpret_cast<const sockaddr*>(&to), sizeof to) > 0
                  ? rubbish.size()
                  : 0;
    }
    room.frame();
    std::this_thread::sleep_for(5ms);
  }
  ::close(fd);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  CHECK(sent > 50'000'000);
  const std::string log = stage.path("take.plog");
  CHECK(static_cast<double>(std::filesystem::file_size(log)) < 1e6 * (took.count() + 2.0));
  const ProgramOutcome replay = posed({"replay", log, "--speed", "max", "--expect", "--json"});
  INFO(replay.err << stage.daemon->errors());
  CHECK(replay.code == 0);
  CHECK(json::parse(replay.out).at("compared") > 100);
}

TEST_CASE("rubbish over TCP, in ever new connections, fills a log slowly, too") {
  Stage stage;
  const std::uint16_t port = free_port();
  stage.folder.write("posed.toml",
                     std::string(Stage::kEndpoints) +
                         "[[source]]\nname = \"room\"\ndriver = \"mvn\"\nstreams = \"all\"\n"
                         "[source.mvn]\nlink = \"tcp\"\nlisten = \"127.0.0.1:" +
                         std::to_string(port) + "\"\n");
  stage.record();
  const auto start = std::chrono::steady_clock::now();
  const std::string rubbish(60'000, 'r');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(port);
  std::uint64_t sent = 0;
  while (std::chrono::steady_clock::now() < start + 4s) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{.tv_sec = 0, .tv_usec = 100'000};
    ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
      ssize_t took = 0;
      while ((took = ::send(fd, rubbish.data(), rubbish.size(), MSG_NOSIGNAL)) > 0) {
        sent += static_cast<std::uint64_t>(took);
      }
    }
    ::close(fd);
  }
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  CHECK(sent > 1'000'000);
  CHECK(static_cast<double>(std::filesystem::file_size(stage.path("take.plog"))) <
        1e6 * (took.count() + 2.0));
}

TEST_CASE("a log is replaced only once its replacement is being written") {
  Walkers busy;
  busy.launch("run");
  Walkers stage;
  stage.record();
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::string before = file_text(stage.path("take.plog"));
  std::ifstream config(stage.path("posed.toml"));
  std::string text{std::istreambuf_iterator<char>(config), {}};
  stage.folder.write("taken.toml", text.replace(text.find("tcp://127.0.0.1:*"), 17, busy.publish));
  const ProgramOutcome refused = posed({"record", "--config", stage.path("taken.toml"), "--out",
                                        stage.path("take.plog"), "--overwrite"});
  CHECK(refused.code == 1);
  CHECK(file_text(stage.path("take.plog")) == before);
  stage.launch("record", {"--out", stage.path("take.plog"), "--overwrite"});
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  CHECK(file_text(stage.path("take.plog")) != before);
  CHECK_FALSE(std::filesystem::exists(stage.path("take.plog.replaced")));
}

TEST_CASE("of two recordings with one name one is refused, and the other's log replays") {
  Walkers stage;
  const std::vector<std::string> arguments{"record", "--config",           stage.path("posed.toml"),
                                           "--out",  stage.path("x.plog"), "--frames"};
  Process one(arguments), two(arguments);
  const auto first = one.line(), second = two.line();
  REQUIRE(first.has_value() != second.has_value());
  Process& refused = first ? two : one;
  Process& recorded = first ? one : two;
  CHECK(refused.exit_code().value_or(0) > 0);
  CHECK(refused.errors().find("exists already") != std::string::npos);
  std::this_thread::sleep_for(500ms);
  SECTION("also with --overwrite") {
    const ProgramOutcome third = posed({"record", "--config", stage.path("posed.toml"), "--out",
                                        stage.path("x.plog"), "--overwrite"});
    CHECK(third.code == 1);
    CHECK(third.err.find("in use") != std::string::npos);
  }
  SECTION("undisturbed") {}
  recorded.send(SIGTERM);
  CHECK(recorded.exit_code() == 0);
  const ProgramOutcome replay =
      posed({"replay", stage.path("x.plog"), "--speed", "max", "--expect"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

TEST_CASE(
    "a log that is deleted is reported while it is recorded, and its name need not be UTF-8") {
  Walkers stage;
  const std::string file = stage.path("latin\xdc.plog");
  stage.launch("record", {"--out", file});
  const auto status = [&] {
    const ProgramOutcome asked = stage.ctl({"status", "--json"});
    INFO(asked.err);
    REQUIRE(asked.code == 0);
    return json::parse(asked.out).at("status");
  };
  const json before = status();
  CHECK(before.at("recorderFile").get<std::string>().ends_with("latin\\xdc.plog"));
  CHECK(before.value("recorderTrouble", "").empty());
  CHECK(posed({"top", "--connect", stage.publish, "--count", "1", "--timeout", "20"}).code == 0);
  std::filesystem::remove(file);
  std::string trouble;
  for (int i = 0; i < 100 && trouble.empty(); ++i) {
    std::this_thread::sleep_for(100ms);
    trouble = status().value("recorderTrouble", "");
  }
  CHECK(trouble.find("deleted, moved or replaced") != std::string::npos);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 1);
  CHECK(stage.daemon->errors().find("recording stopped") != std::string::npos);
}

TEST_CASE("a replay that is interrupted leaves the file that was there") {
  Walkers stage;
  stage.record();
  stage.await_frames("walker", 100);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::string out = stage.folder.write("frames.bin", "before").string();
  Process replay({"replay", stage.path("take.plog"), "--speed", "0.2", "--publish", "--endpoint",
                  "tcp://127.0.0.1:*", "--out", out, "--overwrite"});
  REQUIRE(replay.line());
  replay.send(SIGINT);
  CHECK(replay.exit_code() == 1);
  CHECK(file_text(out) == "before");
  CHECK(posed({"replay", stage.path("take.plog"), "--speed", "max", "--out", out, "--overwrite"})
            .code == 0);
  CHECK(file_text(out).size() > 1000);
  for (const auto& file : std::filesystem::directory_iterator(stage.folder.path())) {
    CHECK(file.path().extension() != ".part");
  }
}

}  // namespace posed::test
