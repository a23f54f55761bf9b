// Calibrates a glove through a running daemon: poses, the file, its use, and the glove to which it
// belongs.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/e2e/served.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/posing_glove.hpp"

namespace posed::test {
namespace {

using drivers::glove::kPoseNames;
using drivers::glove::Pose;
using nlohmann::json;
using namespace std::chrono_literals;

// A walker, and a LucidGlove that connects over TCP and is identified by its address.
class CalibrationStage : public Stage {
 public:
  CalibrationStage() {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    write_config("");
  }

  void write_config(const std::string& calibration) const {
    folder.write("posed.toml",
                 std::string(kEndpoints) +
                     "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n[stream.file]\n"
                     "path = \"walk.bvh\"\nloop = true\n[[stream]]\nname = \"right\"\n"
                     "driver = \"lucidgloves\"\n" +
                     calibration + "[stream.lucidgloves]\nlink = \"tcp\"\nlisten = \"" +
                     endpoint() + "\"\n");
  }

  void put_on() {
    glove.emplace("lucidgloves", emulate::EmulatedPort::connect_tcp(endpoint()).value());
  }

  [[nodiscard]] std::string endpoint() const { return "127.0.0.1:" + std::to_string(port_); }

  // `posed calibrate --connect`; the emulated hand takes each requested pose.
  ProgramOutcome calibrate(const std::vector<std::string>& options) {
    std::vector<std::string> arguments{"calibrate", "--connect", publish,         "--user",
                                       "ann",       "--out",     path("ann.toml")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Process process(arguments);
    std::string out;
    while (const auto line = process.line()) {
      out += *line + "\n";
      for (std::size_t p = 0; p < kPoseNames.size(); ++p) {
        if (*line == "pose " + std::string(kPoseNames[p])) glove->hold(static_cast<Pose>(p));
      }
    }
    const auto code = process.exit_code();
    REQUIRE(code);
    return {*code, out, process.errors()};
  }

  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream file(path(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  void wait_for_frame() const {
    CHECK(posed({"monitor", "--connect", publish, "--stream", "right", "--count", "1"}).code == 0);
  }

  // The present calibrated value of a sensor.
  [[nodiscard]] double value_of(const std::string& sensor) const {
    const ProgramOutcome seen = posed({"monitor", "--connect", publish, "--topic", "sensor",
                                       "--stream", "right", "--json", "--count", "1"});
    REQUIRE(seen.code == 0);
    const auto sample = json::parse(seen.out);
    const auto names = sample.at("name").get<std::vector<std::string>>();
    const auto at = std::ranges::find(names, sensor);
    REQUIRE(at != names.end());
    return sample.at("value").at(static_cast<std::size_t>(at - names.begin()));
  }

  std::optional<PosingGlove> glove;

 private:
  std::uint16_t port_ = free_port();
};

std::string of_another_glove(std::string calibration) {
  const std::string mine = "tcp 127.0.0.1";
  const auto at = calibration.find(mine);
  REQUIRE(at != std::string::npos);
  return calibration.replace(at, mine.size(), "tcp 10.0.0.7");
}

}  // namespace

TEST_CASE("a glove is calibrated through the daemon, and the file is for this glove only") {
  CalibrationStage stage;
  stage.record();
  const ProgramOutcome away = stage.calibrate({"--stream", "right"});
  CHECK(away.code == 1);
  CHECK(has(away.err, "'right' is away"));
  stage.put_on();
  stage.wait_for_frame();

  const ProgramOutcome done = stage.calibrate(
      {"--stream", "right", "--seconds", "0.5", "--ready", "0.5", "--pose", "spread-again=0"});
  INFO(done.err);
  REQUIRE(done.code == 0);
  CHECK(done.out ==
        "pose flat\npose fist\npose thumb\npose spread\npose touch-index\npose touch-middle\n"
        "pose touch-ring\npose touch-little\npose touch-fist\npose flat-again\n");
  CHECK(has(done.err, "poses held twice differed by"));
  CHECK(has(done.err, "posed ctl calibrate right " + stage.path("ann.toml")));
  const std::string mine = stage.read("ann.toml");
  CHECK(
      has(mine, "driver = 'lucidgloves'\nglove = 'tcp 127.0.0.1'\nhand = \"right\"\nuser = 'ann'"));

  stage.glove->hold(Pose::kFist);
  const auto fist = Approx(80.0 / 90.0).margin(0.01);  // of the range; a full curl is 90 degrees
  CHECK(stage.value_of("index_joint1") == fist);
  const ProgramOutcome applied = stage.ctl({"calibrate", "right", stage.path("ann.toml")});
  INFO(applied.err);
  CHECK(applied.code == 0);
  CHECK(stage.value_of("index_joint1") == fist);  // the emulated glove is exact without it, too

  const auto other = stage.folder.write("other.toml", of_another_glove(mine));
  const ProgramOutcome refused = stage.ctl({"calibrate", "right", other.string()});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "glove 'tcp 10.0.0.7' ... 'tcp 127.0.0.1'"));
  CHECK(stage.value_of("index_joint1") == fist);

  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  const ProgramOutcome replayed = posed({"replay", stage.path("take.plog"), "--speed", "max",
                                         "--out", stage.path("frames.bin"), "--expect"});
  INFO(replayed.err);
  CHECK(replayed.code == 0);
}

TEST_CASE("a hand that moved, or never took a pose, gives no calibration") {
  CalibrationStage stage;
  stage.launch("run");
  stage.put_on();
  stage.wait_for_frame();
  const std::vector<std::string> quick{"--stream", "right", "--seconds", "1",
                                       "--ready",  "0.2",   "--brief"};
  {
    const std::jthread restless([&](const std::stop_token& stop) {
      for (bool fist = false; !stop.stop_requested(); fist = !fist) {
        stage.glove->hold(fist ? Pose::kFist : Pose::kFlat);
        std::this_thread::sleep_for(100ms);
      }
    });
    const ProgramOutcome moved = stage.calibrate(quick);
    CHECK(moved.code == 1);
    CHECK(has(moved.err, "fist failed: "));
    CHECK(has(moved.err, "moved"));
    CHECK(has(moved.err, "hold it again"));
  }
  CHECK_FALSE(std::filesystem::exists(stage.path("ann.toml")));

  // A hand that stays flat in every requested pose.
  {
    const std::jthread lazy([&](const std::stop_token& stop) {
      for (; !stop.stop_requested(); std::this_thread::sleep_for(2ms)) {
        stage.glove->hold(Pose::kFlat);
      }
    });
    const ProgramOutcome flat = stage.calibrate(quick);
    CHECK(flat.code == 1);
    CHECK(has(flat.err, "hardly moved ... flat"));
  }
  CHECK_FALSE(std::filesystem::exists(stage.path("ann.toml")));

  // An existing file is not replaced without --overwrite, and an option without effect is reported.
  stage.folder.write("ann.toml", "mine");
  const ProgramOutcome there = stage.calibrate(quick);
  CHECK(there.code == 2);
  CHECK(has(there.err, "add --overwrite"));
  CHECK(stage.read("ann.toml") == "mine");
  const ProgramOutcome useless =
      stage.calibrate({"--stream", "right", "--ready", "1", "--overwrite"});
  CHECK(useless.code == 2);
  CHECK(has(useless.err, "add --seconds"));
}

TEST_CASE("calibrate --connect reports what is wrong with a request") {
  CalibrationStage stage;
  stage.launch("run");
  const auto refused = [&](const std::vector<std::string>& options, const std::string& sentence) {
    const ProgramOutcome done = stage.calibrate(options);
    CHECK(done.code == 2);
    CHECK(has(done.err, sentence));
  };
  refused({"--stream", "nobody"}, "'nobody' ... walker, right");
  refused({"--stream", "walker"}, "no sensors");
  refused({}, "--connect ... --stream");
  stage.put_on();
  stage.wait_for_frame();
  refused({"--stream", "right", "--hand", "left"}, "is of a right hand");
  refused({"--stream", "right", "--driver", "cyberglove"}, "'lucidgloves'");
  CHECK_FALSE(std::filesystem::exists(stage.path("ann.toml")));
}

TEST_CASE(
    "a stream's calibration waits for its glove; another glove is refused with an error message") {
  CalibrationStage stage;
  const std::string toml =
      "format = 1\ndriver = \"lucidgloves\"\nhand = \"right\"\nuser = \"ann\"\n"
      "glove = \"tcp 127.0.0.1\"\n[sensors]\nindex_joint1 = [[0, 0.0], [2000, 1.0]]\n";
  stage.folder.write("mine.toml", toml);
  stage.folder.write("other.toml", of_another_glove(toml));
  stage.write_config("calibration = \"mine.toml\"\n");
  stage.launch("run");  // the glove is not connected, so its identity is not known yet
  stage.put_on();
  stage.glove->hold(Pose::kFist);
  stage.wait_for_frame();
  CHECK(stage.value_of("index_joint1") > 1.5);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);

  stage.glove.reset();
  stage.write_config("calibration = \"other.toml\"\n");
  stage.launch("run");
  Process events(
      {"monitor", "--connect", stage.publish, "--topic", "event", "--stream", "right", "--json"});
  bool refusal_seen = false;
  for (int i = 0; i < 10 && !refusal_seen; ++i) {
    stage.put_on();  // posed hangs up; the glove reconnects
    for (std::optional<std::string> line; !refusal_seen && (line = events.line(2s));) {
      refusal_seen = line->contains("glove 'tcp 10.0.0.7'");
    }
  }
  CHECK(refusal_seen);
  const auto status = json::parse(stage.ctl({"--json", "status"}).out).at("status");
  const auto& right = status.at("stream").at(1);
  CHECK(right.at("away") == true);
  CHECK(right.at("identity") == "");
}

}  // namespace posed::test
