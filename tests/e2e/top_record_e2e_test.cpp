// `posed top --record`: the lines of --json in a file, whole whenever it ends.
#include <catch2/catch.hpp>

#include <chrono>
#include <csignal>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/has.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

// The lines of the file; each has to be JSON.
std::vector<nlohmann::json> recorded_lines(const std::string& path) {
  const std::string text = file_text(path);
  if (!text.empty()) CHECK(text.back() == '\n');
  std::vector<nlohmann::json> lines;
  std::istringstream all(text);
  for (std::string line; std::getline(all, line);) {
    lines.push_back(nlohmann::json::parse(line, nullptr, false));
    CHECK_FALSE(lines.back().is_discarded());
  }
  return lines;
}

TEST_CASE("top keeps what it shows, as the lines of --json") {
  Served served;
  served.start();
  const std::string path = served.path("show.jsonl");
  const auto top = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"top", "--connect", served.publish, "--record", path});
    return posed(std::move(options));
  };
  const ProgramOutcome shown = top({"--count", "2"});
  CHECK(shown.code == 0);
  CHECK(has(shown.out, "walker"));  // the screen goes on
  const auto lines = recorded_lines(path);
  REQUIRE(lines.size() == 2);
  CHECK(lines[0].at("stream").at(0).at("stream") == "walker");
  CHECK(std::stoll(lines[1].at("timeNs").get<std::string>()) >
        std::stoll(lines[0].at("timeNs").get<std::string>()));

  const ProgramOutcome refused = top({"--count", "1"});
  CHECK(refused.code == 2);
  CHECK(has(refused.err, "--overwrite"));
  CHECK(recorded_lines(path).size() == 2);
  const ProgramOutcome both = top({"--count", "1", "--json", "--overwrite"});
  CHECK(both.code == 0);
  CHECK(both.out == file_text(path));
}

TEST_CASE("top's file is whole when Ctrl-C comes, and an old one stays until the first line") {
  Served served;
  served.start();
  const std::string path = served.path("show.jsonl");
  Process top({"top", "--connect", served.publish, "--record", path});
  REQUIRE(top.line());
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (file_text(path).empty() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(20ms);
  }
  top.send(SIGINT);
  CHECK(top.exit_code() == 0);
  CHECK_FALSE(recorded_lines(path).empty());

  const std::string before = file_text(path);
  const ProgramOutcome nobody = posed(
      {"top", "--connect", "tcp://127.0.0.1:9", "--record", path, "--overwrite", "--timeout", "2"});
  CHECK(nobody.code == 1);
  CHECK(file_text(path) == before);
}

TEST_CASE("top refuses a file that is something else") {
  const TempFolder folder;
  const auto refused = [&](const std::string& name) {
    return posed({"top", "--record", (folder.path() / name).string()});
  };
  CHECK(refused("walk.bvh").code == 2);
  CHECK(has(refused("walk.bvh").err, "end in .jsonl"));
  CHECK(refused("no/such.jsonl").code == 2);
  CHECK(posed({"top", "--record", "/dev/full"}).code == 2);
  CHECK(posed({"top", "--overwrite"}).code == 2);
}

TEST_CASE("top and monitor give up at stats that cannot be read, as at silence") {
  const auto context = net::open_context().value();
  const auto socket = net::open_socket(context.get(), ZMQ_PUB).value();
  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(free_port());
  REQUIRE(zmq_bind(socket.get(), endpoint.c_str()) == 0);
  const std::jthread sender([&](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(50ms)) {
      static_cast<void>(net::send_part(socket.get(), "stats", true));
      static_cast<void>(net::send_part(socket.get(), "\xff\xff no stats", false));
    }
  });
  for (std::vector<std::string> command :
       {std::vector<std::string>{"top"}, {"monitor", "--topic", "stats"}, {"monitor"}}) {
    command.insert(command.end(), {"--connect", endpoint, "--count", "1", "--timeout", "2"});
    const ProgramOutcome outcome = posed(std::move(command));
    CHECK(outcome.code == 1);
    CHECK(has(outcome.err, "gave up after"));
  }
}

TEST_CASE("top keeps a file that came while it waited") {
  Served served;
  const std::string path = served.path("show.jsonl");
  const std::uint16_t port = free_port();
  Process top(
      {"top", "--connect", "tcp://127.0.0.1:" + std::to_string(port), "--record", path, "--json"});
  std::this_thread::sleep_for(500ms);  // it has looked at the path
  served.folder.write("show.jsonl", "of somebody else\n");
  std::string config = file_text(served.path("posed.toml"));
  config.replace(config.find("tcp://127.0.0.1:*"), 17, "tcp://127.0.0.1:" + std::to_string(port));
  served.folder.write("posed.toml", config);
  served.start();
  CHECK(top.exit_code().value_or(0) != 0);
  CHECK(has(top.errors(), "exists already"));
  CHECK(file_text(path) == "of somebody else\n");
}

}  // namespace
}  // namespace posed::test
