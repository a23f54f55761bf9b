// Start and end of the real binary with gloves that do not respond: it streams the available
// devices at once, opens the others in parallel, and reacts to a signal at every moment.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <vector>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/pipe.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

// An idle machine needs a tenth of this; opening eight silent gloves one after the other took 16.6
// s.
constexpr auto kAtOnce = 5s;

double ms_since(SteadyClock::time_point begin) {
  return std::chrono::duration<double, std::milli>(SteadyClock::now() - begin).count();
}

// A walker and eight gloves that are plugged in but never send anything.
class SilentGloves : public Stage {
 public:
  SilentGloves() {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    std::string config = std::string(kEndpoints) +
                         "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n[stream.file]\n"
                         "path = \"walk.bvh\"\nloop = true\n";
    const std::vector<std::string> drivers{"cyberglove", "lucidgloves", "fivedt"};
    for (std::size_t i = 0; i < 8; ++i) {
      const std::string glove = "glove" + std::to_string(i);
      gloves_.push_back(emulate::EmulatedPort::open_pty(path(glove)).value());
      config += "[[stream]]\nname = \"" + glove + "\"\ndriver = \"" + drivers[i % drivers.size()] +
                "\"\nport = \"" + path(glove) + "\"\n";
    }
    folder.write("posed.toml", config);
  }

  // Starts a command and waits until it blocks its stop signals, which it does first.
  void start_and_catch(const std::string& command, const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments{command, "--config", path("posed.toml")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    daemon.emplace(std::move(arguments));
    const auto holds_signals = [this] {
      std::ifstream status("/proc/" + std::to_string(daemon->pid()) + "/status");
      for (std::string word; status >> word;) {
        if (word != "SigBlk:") continue;
        std::string mask;
        status >> mask;
        const auto held = [bits = std::stoull(mask, nullptr, 16)](int signal) {
          return (bits >> (signal - 1) & 1) != 0;
        };
        return held(SIGINT) &&
               !held(SIGUSR1);  // all signals are blocked for a moment while a thread is created
      }
      return false;
    };
    const auto begin = SteadyClock::now();
    while (!holds_signals() && SteadyClock::now() - begin < 30s) std::this_thread::sleep_for(1ms);
  }

  void expect_end(int signal) {
    const auto begin = SteadyClock::now();
    daemon->send(signal);
    CHECK(daemon->exit_code(kAtOnce) == 0);
    WARN("signal to the end: " << ms_since(begin) << " ms");
    INFO(daemon->errors());
    CHECK_FALSE(daemon->errors().contains("posed stops"));
  }

 private:
  std::vector<emulate::EmulatedPort> gloves_;
};

}  // namespace

TEST_CASE("eight silent gloves delay neither the start, nor the walker, nor the end") {
  SilentGloves stage;
  const auto begin = SteadyClock::now();
  stage.launch("run");
  const double ready_ms = ms_since(begin);
  WARN("start to ready: " << ready_ms << " ms");
  CHECK(ready_ms < 1e3 * std::chrono::duration<double>(kAtOnce).count());
  CHECK(
      posed({"monitor", "--connect", stage.publish, "--stream", "walker", "--count", "30"}).code ==
      0);
  // The daemon reports the state of its streams once per second.
  const auto gloves_away = [&] {
    const auto status = json::parse(stage.ctl({"--json", "status"}).out).at("status");
    REQUIRE(status.at("stream").size() == 9);
    return std::ranges::count(status.at("stream"), true,
                              [](const json& stream) { return stream.at("away").get<bool>(); });
  };
  for (int i = 0; i < 100 && gloves_away() != 8; ++i) std::this_thread::sleep_for(100ms);
  CHECK(gloves_away() == 8);
  stage.expect_end(SIGINT);  // while all eight are in their start-up exchange
}

TEST_CASE("a signal that comes while posed starts ends it cleanly") {
  for (const std::string command : {"run", "record"}) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      SilentGloves stage;
      const std::vector<std::string> options{"--out", stage.path("take.plog")};
      stage.start_and_catch(command, command == "record" ? options : std::vector<std::string>{});
      stage.expect_end(signal);
      if (command == "run") continue;
      const ProgramOutcome replay = posed({"replay", stage.path("take.plog"), "--speed", "max"});
      INFO(replay.err);
      CHECK(replay.code == 0);  // short, but complete
    }
  }
}

TEST_CASE("a second signal changes nothing") {
  SilentGloves stage;
  stage.launch("record", {"--out", stage.path("take.plog")});
  stage.daemon->send(SIGTERM);
  stage.daemon->send(SIGINT);
  stage.expect_end(SIGTERM);
  CHECK(posed({"replay", stage.path("take.plog"), "--speed", "max"}).code == 0);
}

TEST_CASE("invalid options of a glove are refused at the start, with or without the glove") {
  Stage stage;
  for (const auto& [options, sentence] : std::vector<std::pair<std::string, std::string>>{
           {"baud = -1\n", "stream 'right': baud should be 1 to 4000000"},
           {"link = \"radio\"\n", "stream 'right': link should be \"serial\" or \"tcp\""},
           {"link = \"tcp\"\nlisten = \"0.0.0.0:5200\"\n", "name the gloves' addresses in peers"},
           {"hand = \"middle\"\n", "hand"}}) {
    stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                         "[[stream]]\nname = \"right\"\ndriver = \"cyberglove\"\n"
                                         "[stream.cyberglove]\n" +
                                         options);
    for (const char* command : {"run", "check"}) {
      const ProgramOutcome refused = posed({command, "--config", stage.path("posed.toml")});
      CHECK(refused.code == 2);
      CHECK(has(refused.err, sentence));
    }
  }
}

TEST_CASE("--until-end waits for streams that can end, and is refused where none can") {
  SilentGloves stage;
  const ProgramOutcome refused =
      posed({"run", "--config", stage.path("posed.toml"), "--until-end"});
  CHECK(refused.code == 2);
  CHECK(has(refused.err, "--until-end: ... ends"));
  std::ifstream file(stage.path("posed.toml"));
  std::string config{std::istreambuf_iterator<char>(file), {}};
  config.replace(config.find("loop = true"), 11, "loop = false");
  stage.folder.write("posed.toml", config);
  const ProgramOutcome ended = posed({"record", "--config", stage.path("posed.toml"), "--out",
                                      stage.path("take.plog"), "--frames", "--until-end"});
  INFO(ended.err);
  CHECK(ended.code == 0);
  const ProgramOutcome replay =
      posed({"replay", stage.path("take.plog"), "--speed", "max", "--expect", "--json"});
  INFO(replay.err);
  CHECK(replay.code == 0);
  CHECK(json::parse(replay.out).at("compared") > 100);
}

TEST_CASE("a full stdout delays neither the start nor the end") {
  SilentGloves stage;
  Pipe out;
  out.fill();
  stage.daemon.emplace(std::vector<std::string>{"run", "--config", stage.path("posed.toml")},
                       ChildStderr{}, out.write_end());
  for (int i = 0; i < 1000 && !stage.daemon->errors().contains("stdout does not take"); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  CHECK(has(stage.daemon->errors(), "tcp://127.0.0.1:"));  // the log has the endpoints instead
  stage.expect_end(SIGTERM);
}

}  // namespace posed::test
