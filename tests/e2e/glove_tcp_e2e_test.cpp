// A CyberGlove III on the network: the glove is the client and sends 16-bit records. It is
// disconnected and connected again while its hand moves, and no frame may mix two records.
#include <catch2/catch.hpp>

#include <chrono>
#include <cmath>
#include <csignal>
#include <optional>
#include <string>
#include <thread>

#include "drivers/glove/angle_map.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/e2e/events.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/posing_glove.hpp"

namespace posed::test {
namespace {

using drivers::glove::hand_in;
using drivers::glove::Pose;
using namespace std::chrono_literals;

constexpr double kCount_rad = 0.02;  // a count of the coarsest sensor is 0.0182 rad

// Whether all finger joints are bent as in this pose.
bool bends_as(const v1::Frame& frame, Pose pose) {
  const HandAngles wanted = hand_in(pose);
  for (const char* finger : {"index", "middle", "ring", "little"}) {
    for (const char* joint : {"1_x", "2_x", "3_x"}) {
      const int at = drivers::glove::hand_channel(std::string(finger) + joint);
      const auto place = static_cast<std::size_t>(at);
      const float angle = frame.angle_rad(static_cast<int>(kChannelOfAngle[place]));
      if (!(std::abs(static_cast<double>(angle) - wanted[place]) <= kCount_rad)) return false;
    }
  }
  return true;
}

}  // namespace

TEST_CASE(
    "a CyberGlove III that connects over TCP is read, lost and found; no frame mixes two records") {
  Stage stage;
  const std::string endpoint = "127.0.0.1:" + std::to_string(free_port());
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                       "[[stream]]\nname = \"right\"\ndriver = \"cyberglove\"\n"
                                       "[stream.cyberglove]\nlink = \"tcp\"\nform = \"16bit\"\n"
                                       "listen = \"" +
                                       endpoint + "\"\n[stream.constrain]\nenabled = false\n");
  stage.record();
  Process events({"monitor", "--connect", stage.publish, "--topic", "event", "--json"});
  const auto frames_come = [&] {
    return posed({"monitor", "--connect", stage.publish, "--stream", "right", "--count", "30"})
               .code == 0;
  };
  for (int i = 0; i < 3; ++i) {
    std::optional<PosingGlove> glove;
    glove.emplace("cyberglove", emulate::EmulatedPort::connect_tcp(endpoint).value(),
                  drivers::Options{{"link", std::string("tcp")}, {"form", std::string("16bit")}});
    CHECK(frames_come());
    if (i > 0) wait_for(events, "KIND_RECOVERED");
    for (int turn = 0; turn < 10; ++turn) {
      glove->hold(turn % 2 == 0 ? Pose::kFist : Pose::kFlat);
      std::this_thread::sleep_for(70ms);
    }
    glove.reset();  // cuts the connection
    wait_for(events, "KIND_LOST");
    wait_for(events, "KIND_STALE");
  }
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);

  int fists = 0, flats = 0, others = 0;
  check_frames_follow(stage.path("take.plog"), "right", [&](const v1::Frame& frame) {
    if (bends_as(frame, Pose::kFist)) {
      ++fists;
    } else if (bends_as(frame, Pose::kFlat)) {
      ++flats;
    } else {
      ++others;
    }
  });
  CHECK(others == 0);
  CHECK(fists > 3 * 10);
  CHECK(flats > 3 * 10);
  const ProgramOutcome replayed = posed({"replay", stage.path("take.plog"), "--speed", "max",
                                         "--out", stage.path("frames.bin"), "--expect"});
  INFO(replayed.err);
  CHECK(replayed.code == 0);

  stage.launch("run");
  Process emulate({"emulate", "cyberglove", "--tcp", endpoint, "--set", "form=16bit"});
  CHECK(frames_come());
  const auto status = nlohmann::json::parse(stage.ctl({"--json", "status"}).out).at("status");
  CHECK(status.at("stream").at(0).at("deviceInfo").get<std::string>().contains("form=16bit"));
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  CHECK(emulate.exit_code() == 0);  // its host has hung up
}

}  // namespace posed::test
