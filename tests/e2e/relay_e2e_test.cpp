// `posed relay` between real daemons and real subscribers.
#include <catch2/catch.hpp>

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/has.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// A relay and the endpoint where it really listens.
struct RelayProcess {
  explicit RelayProcess(std::vector<std::string> options) {
    options.insert(options.begin(), "relay");
    if (std::ranges::find(options, "--bind") == options.end()) {
      options.insert(options.end(), {"--bind", "tcp://127.0.0.1:*"});
    }
    process = std::make_unique<Process>(std::move(options));
    const auto line = process->line();
    INFO(process->errors());
    REQUIRE(line);
    publish = json::parse(*line).at("publish");
  }

  std::unique_ptr<Process> process;
  std::string publish;
};

std::string fixed_endpoint() { return "tcp://127.0.0.1:" + std::to_string(free_port()); }

// A daemon that publishes at a known endpoint, so that it can come back there.
void launch_at(Stage& stage, const std::string& endpoint, const std::string& stream) {
  REQUIRE(clip::write_bvh(toy_walk(240, 120.0), stage.folder.path() / "walk.bvh"));
  stage.folder.write("posed.toml", "realtime = false\n[publish]\nendpoint = \"" + endpoint +
                                       "\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
                                       "[[stream]]\nname = \"" +
                                       stream +
                                       "\"\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\n"
                                       "loop = true\n");
  stage.launch("run");
}

TEST_CASE("a subscriber of a relay sees what the daemon publishes, and ctrl-c ends the relay") {
  Served served;
  served.start();
  RelayProcess relay({"--from", served.publish, "--json"});
  const auto poses = posed({"monitor", "--connect", relay.publish, "--stream", "walker", "--count",
                            "20", "--json", "--timeout", "20"});
  INFO(poses.err);
  REQUIRE(poses.code == 0);
  std::uint64_t before = 0;
  std::istringstream lines(poses.out);
  for (std::string line; std::getline(lines, line);) {
    const json frame = json::parse(line);
    CHECK(frame.at("stream") == "walker");
    const auto sequence = std::stoull(frame.at("sequence").get<std::string>());
    CHECK(sequence > before);
    before = sequence;
  }
  // Comes late, and gets the skeleton all the same.
  const auto skeleton =
      posed({"monitor", "--connect", relay.publish, "--topic", "skeleton", "--stream", "walker-raw",
             "--count", "1", "--json", "--timeout", "20"});
  REQUIRE(skeleton.code == 0);
  CHECK_FALSE(json::parse(skeleton.out).at("jointName").empty());
  json counts;
  while (const auto line = relay.process->line()) {
    counts = json::parse(*line);
    if (counts.at("messages") > 20 && counts.at("upstreams") == 1) break;
  }
  CHECK(counts.at("streams") == 2);
  CHECK(counts.at("foreign") == 0);
  CHECK(counts.at("clashes") == 0);
  relay.process->send(SIGINT);
  CHECK(relay.process->exit_code() == 0);
}

TEST_CASE("a relay and its subscribers use keys on both sides") {
  Served served;
  for (const char* name : {"server", "relay", "viewer", "stranger"}) {
    REQUIRE(posed({"keygen", name, "--out", served.folder.path().string()}).code == 0);
  }
  served.write_config(
      "[security]\nserver_key = \"server.key\"\n"
      "[[security.client]]\nname = \"relay\"\npublic_key = \"relay.pub\"\n");
  served.start();
  served.folder.write("relay.toml",
                      "[security]\nserver_key = \"relay.key\"\n"
                      "[[security.client]]\nname = \"viewer\"\npublic_key = \"viewer.pub\"\n");
  RelayProcess relay({"--from", served.publish, "--key", served.path("relay.key"), "--server-key",
                      served.path("server.pub"), "--security", served.path("relay.toml")});
  const auto as = [&](const char* who) {
    return std::vector<std::string>{"monitor",
                                    "--connect",
                                    relay.publish,
                                    "--count",
                                    "3",
                                    "--timeout",
                                    "20",
                                    "--key",
                                    served.path(std::string(who) + ".key"),
                                    "--server-key",
                                    served.path("relay.pub")};
  };
  CHECK(posed(as("viewer")).code == 0);
  CHECK(has(posed(as("stranger")).err, "refuses this key"));
  CHECK(has(posed({"monitor", "--connect", relay.publish, "--count", "1"}).err, "wants a key"));

  RelayProcess keyless({"--from", served.publish});
  CHECK(keyless.process->comes_to_say("wants a key"));
  CHECK(has(keyless.process->errors(), "the daemon at " + served.publish));

  Served open;
  open.start();
  RelayProcess mistaken({"--from", open.control});
  CHECK(mistaken.process->comes_to_say("not its publish endpoint"));
}

TEST_CASE("a relay finds a daemon that comes back") {
  Stage stage;
  const std::string endpoint = fixed_endpoint();
  RelayProcess relay({"--from", endpoint});  // before the daemon
  launch_at(stage, endpoint, "walker");
  Process monitor({"monitor", "--connect", relay.publish, "--topic", "pose"});
  REQUIRE(monitor.line());
  stage.daemon->send(SIGKILL);
  REQUIRE(stage.daemon->exit_code());
  while (monitor.line(500ms)) {
  }
  launch_at(stage, endpoint, "walker");
  CHECK(monitor.line());
  CHECK(has(relay.process->errors(), "lost ... again"));
}

TEST_CASE("a relay of two daemons has the streams of both, and their stats as one") {
  Stage first;
  Stage second;
  launch_at(first, fixed_endpoint(), "left");
  launch_at(second, fixed_endpoint(), "right");
  RelayProcess relay({"--from", first.publish, "--from", second.publish});
  for (const char* stream : {"left", "right"}) {
    const auto seen = posed({"monitor", "--connect", relay.publish, "--topic", "pose", "--stream",
                             stream, "--count", "3", "--timeout", "20"});
    INFO(seen.err);
    CHECK(seen.code == 0);
  }
  Process stats({"monitor", "--connect", relay.publish, "--topic", "stats", "--json"});
  json streams;
  for (int i = 0; i < 20 && streams.size() != 2; ++i) {
    const auto line = stats.line();
    REQUIRE(line);
    streams = json::parse(*line).at("stream");
  }
  REQUIRE(streams.size() == 2);
  CHECK(streams[0].at("stream") == "left");
  CHECK(streams[1].at("stream") == "right");
}

TEST_CASE("a relay refuses what it cannot do, in one sentence") {
  const std::vector<std::string> relay{"relay", "--from", "tcp://127.0.0.1:9"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), relay.begin(), relay.end());
    return posed(std::move(options));
  };
  const auto open = with({"--bind", "tcp://0.0.0.0:*"});
  CHECK(open.code == 2);
  CHECK(has(open.err, "other machines ... --insecure"));
  CHECK(with({"--bind", "tcp://0.0.0.0:*", "--insecure", "--seconds", "0.1"}).code == 0);
  CHECK(with({"--bind", "nonsense://x", "--insecure"}).code == 1);
  CHECK(has(with({"--bind", "tcp://127.0.0.1:*", "--insecure"}).err, "--insecure has no effect"));
  CHECK(with({"--key", "a.key", "--server-key", "a.pub", "--server-key", "b.pub"}).code == 2);
  CHECK(has(with({"--bind", "tcp://127.0.0.1:6999", "--from", "tcp://127.0.0.1:6999"}).err,
            "is both --from and --bind"));
  CHECK(with({"--security", "/nonexistent.toml"}).code != 0);
  TempFolder folder;
  folder.write("none.toml", "[security]\n");
  CHECK(has(with({"--security", (folder.path() / "none.toml").string()}).err, "no server_key"));
  CHECK(has(with({"--security", (folder.path() / "none.toml").string(), "--insecure"}).err,
            "leave one of them out"));
}

}  // namespace
}  // namespace posed::test
