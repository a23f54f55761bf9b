// Daemons that chain: the stream of one is the device of the next.
#include <catch2/catch.hpp>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "models/motion/synthetic_walker.hpp"
#include "models/style/model/style_model.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/has.hpp"
#include "tests/support/replaced.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// The frames that a monitor prints, by their arrival on the first machine where that is the
// device's time, until there are `count`.
std::vector<json> monitored_frames(const std::string& endpoint, const std::string& stream,
                                   int count) {
  const auto out = posed({"monitor", "--connect", endpoint, "--stream", stream, "--count",
                          std::to_string(count), "--json", "--timeout", "30"});
  INFO(out.err);
  REQUIRE(out.code == 0);
  std::vector<json> frames;
  std::istringstream lines(out.out);
  for (std::string line; std::getline(lines, line);) frames.push_back(json::parse(line));
  return frames;
}

// The second machine, whose device is the first one's stream.
std::string chain_config(const std::string& connect, const std::string& more = "",
                         const std::string& stream = "walker") {
  return std::string(Stage::kEndpoints) +
         "[[source]]\nname = \"up\"\ndriver = \"posed\"\nstreams = \"all\"\n[source.posed]\n"
         "connect = \"" +
         connect + "\"\nstream = \"" + stream + "\"\n" + more;
}

// The first machine: a clip of walking at a known endpoint, so that it can come back there.
void launch_first(Served& served, const std::string& endpoint) {
  served.write_config("");
  const std::string text = file_text(served.folder.path() / "posed.toml");
  const std::string any = "tcp://127.0.0.1:*";
  served.folder.write("posed.toml",
                      std::string(text).replace(text.find(any), any.size(), endpoint));
  served.start();
}

// The largest difference between a pose of the second machine and that pose of the first that is
// nearest to it; each must be one of them.
double furthest(const std::vector<json>& first, const std::vector<json>& second) {
  double worst = 0.0;
  for (const json& pose : second) {
    double best = 1e9;
    for (const json& sent : first) {
      double far = 0.0;
      for (const char* list : {"rotationXyzw", "rootPositionM"}) {
        REQUIRE(pose.at(list).size() == sent.at(list).size());
        for (std::size_t i = 0; i < pose.at(list).size(); ++i) {
          const double difference = pose.at(list)[i].get<double>() - sent.at(list)[i].get<double>();
          far = std::max(far, std::abs(difference));
        }
      }
      best = std::min(best, far);
    }
    worst = std::max(worst, best);
  }
  return worst;
}

// Ends the recording and compares its replay with what was published.
void check_replay(Stage& recorded) {
  recorded.daemon->send(SIGINT);
  CHECK(recorded.daemon->exit_code() == 0);
  recorded.check_replay();
}

TEST_CASE("a daemon streams what another one publishes, to float precision") {
  Served served;
  served.start();
  Stage next;
  // The input of the stages repeats with the clip, which has 240 frames; a busy machine misses
  // some.
  next.folder.write("posed.toml", chain_config(served.publish, "", "walker-raw"));
  next.launch("run");
  const auto second = monitored_frames(next.publish, "up-walker-raw", 20);
  const auto first = monitored_frames(served.publish, "walker-raw", 600);
  CHECK(furthest(first, second) < 1e-6);  // the sender's rotations have unit length to 1e-7
  std::uint64_t before = 0;
  for (const json& frame : second) {
    const auto sequence = std::stoull(frame.at("sequence").get<std::string>());
    CHECK(sequence > before);
    before = sequence;
    CHECK(frame.contains("deviceNs"));
  }
  const auto skeleton = [](const std::string& endpoint, const std::string& stream) {
    return json::parse(posed({"monitor", "--connect", endpoint, "--topic", "skeleton", "--stream",
                              stream, "--count", "1", "--json", "--timeout", "30"})
                           .out);
  };
  const json sent = skeleton(served.publish, "walker-raw");
  const json got = skeleton(next.publish, "up-walker-raw");
  for (const char* list : {"jointName", "parent", "offsetM", "humanoidBone"}) {
    CHECK(got.at(list) == sent.at(list));
  }
}

TEST_CASE("a chained stream is lost and found with the daemon before it") {
  Served served;
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_port());
  Stage next;
  next.folder.write("posed.toml", chain_config(endpoint));
  next.launch("run");  // before the first one is there
  Process events({"monitor", "--connect", next.publish, "--topic", "event"});
  launch_first(served, endpoint);
  CHECK(monitored_frames(next.publish, "up-walker", 5).size() == 5);
  const auto comes = [&](const std::string& part) {
    while (const auto line = events.line()) {
      if (line->contains(part)) return true;
    }
    return false;
  };
  CHECK(comes("the first data came"));
  served.daemon->send(SIGKILL);
  CHECK(comes(" lost "));
  launch_first(served, endpoint);
  CHECK(comes(" found "));
  CHECK(monitored_frames(next.publish, "up-walker", 5).size() == 5);
}

TEST_CASE(
    "a recording in which the upstream went and returned as another person replays as it was") {
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_port());
  Stage first;
  first.folder.write("posed.toml",
                     replaced(Stage::kEndpoints, "tcp://127.0.0.1:*", endpoint) + Stage::kWalker);
  const auto publish = [&](const clip::Clip& walk) {
    REQUIRE(clip::write_bvh(walk, first.folder.path() / "walk.bvh"));
    first.launch("run");
  };
  const auto joints_now = [](const Stage& stage) {
    return monitored_frames(stage.publish, "up-walker", 1).at(0).at("rotationXyzw").size() / 4;
  };
  publish(toy_walk(240, 120.0));
  Stage next;
  next.folder.write("posed.toml", chain_config(endpoint));
  next.record();
  const std::size_t before = joints_now(next);
  first.daemon->send(SIGKILL);
  publish(motion::make_walker({.seconds = 2.0, .rate_hz = 120.0}).value());
  std::size_t after = before;
  for (int i = 0; i < 600 && after == before; ++i) after = joints_now(next);
  CHECK(after > before);
  CHECK(monitored_frames(next.publish, "up-walker", 30).size() == 30);
  check_replay(next);
  std::set<int> people;  // that the log has frames of, by their joints
  static_cast<void>(check_frames_follow(
      next.path("take.plog"), "up-walker",
      [&](const auto& frame) { people.insert(frame.rotation_xyzw_size() / 4); }));
  CHECK(people == std::set{static_cast<int>(before), static_cast<int>(after)});
}

TEST_CASE("daemons and a relay chain with keys, and say which key is wrong") {
  Served served;
  for (const char* name : {"server", "next", "stranger"}) {
    REQUIRE(posed({"keygen", name, "--out", served.folder.path().string()}).code == 0);
  }
  served.write_config(
      "[security]\nserver_key = \"server.key\"\n"
      "[[security.client]]\nname = \"next\"\npublic_key = \"next.pub\"\n");
  served.start();
  Stage next;
  const auto with_key = [&](const std::string& name) {
    for (const std::string& file : {name + ".key", std::string("server.pub")}) {
      std::filesystem::copy_file(served.folder.path() / file, next.folder.path() / file,
                                 std::filesystem::copy_options::overwrite_existing);
    }
    next.folder.write("posed.toml",
                      chain_config(served.publish, "key = \"" + name +
                                                       ".key\"\n"
                                                       "server_key = \"server.pub\"\n"));
  };
  with_key("next");  // beside the config, by a relative path
  next.launch("run");
  CHECK(monitored_frames(next.publish, "up-walker", 5).size() == 5);
  next.daemon.reset();
  const auto says = [&](const std::string& part) {
    next.launch("run");
    static_cast<void>(next.daemon->comes_to_say(part));
    CHECK(has(next.daemon->errors(), part));
    next.daemon.reset();
  };
  with_key("stranger");
  says("refuses this key");
  next.folder.write("posed.toml", chain_config(served.publish));
  says("wants a key");
}

TEST_CASE("an emulated posed is heard over ZeroMQ, recorded, and replayed bit for bit") {
  Process emulator(
      {"emulate", "posed", "--set", "stream=walker", "--publish", "tcp://127.0.0.1:*"});
  const auto ready = emulator.line();
  REQUIRE(ready);
  Stage next;
  next.folder.write("posed.toml", chain_config(json::parse(*ready).at("port")));
  next.record();
  CHECK(monitored_frames(next.publish, "up-walker", 60).size() == 60);
  check_replay(next);
}

TEST_CASE("an emulated device is open to other machines only if that is wanted") {
  const auto emulate = [](const char* driver, const char* where, const std::string& address,
                          std::vector<std::string> more) {
    std::vector<std::string> words{"emulate", driver, where, address, "--seconds", "0.1"};
    words.insert(words.end(), more.begin(), more.end());
    return posed(std::move(words));
  };
  for (const auto& [driver, where, open, here] :
       {std::array{"posed", "--publish", "tcp://0.0.0.0:*", "tcp://127.0.0.1:*"},
        std::array{"axis", "--listen", "0.0.0.0:0", "127.0.0.1:0"}}) {
    const auto refused = emulate(driver, where, open, {});
    CHECK(refused.code == 2);
    CHECK(has(refused.err, "other machines ... --insecure"));
    CHECK(emulate(driver, where, open, {"--insecure"}).code == 0);
    CHECK(emulate(driver, where, here, {}).code == 0);
    const auto pointless = emulate(driver, where, here, {"--insecure"});
    CHECK(pointless.code == 2);
    CHECK(has(pointless.err, "--insecure has no effect"));
  }
}

TEST_CASE("the configs of stages are sound") {
  const TempFolder top;
  const std::filesystem::path folder = top.path() / "stage";
  std::filesystem::copy(source_dir() / "config/stage", folder,
                        std::filesystem::copy_options::recursive);
  std::filesystem::copy(source_dir() / "config/robots", top.path() / "robots");
  for (const char* name : {"capture", "stylist", "relay", "avatar"}) {
    REQUIRE(posed({"keygen", name, "--out", (folder / "keys").string()}).code == 0);
  }
  REQUIRE(style::save_model(toy_model(1, 0.3), folder / "walk.style"));
  for (const char* name : {"capture.toml", "stylist.toml", "unreal.toml", "robot.toml"}) {
    const auto checked = posed({"check", "--config", (folder / name).string()});
    INFO(checked.out << checked.err);
    CHECK(checked.code == 0);
  }
  const auto relay = posed({"relay", "--from", "tcp://127.0.0.1:9", "--bind", "tcp://127.0.0.1:*",
                            "--security", (folder / "relay.toml").string(), "--seconds", "0.2"});
  INFO(relay.err);
  CHECK(relay.code == 0);
}

}  // namespace
}  // namespace posed::test
