// Readers of the program's output that are slow or gone: stderr and stdout of the real binary are
// full, closed or abandoned while it streams and while control messages flood it.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <future>
#include <string>
#include <vector>

#include <zmq.h>

#include "posed/v1/control.pb.h"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/pipe.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

// Sends changes of alpha as fast as the daemon replies, a few at a time. Returns the number of
// replies. Without Catch's macros, because it also runs beside the test's own thread.
int flood_alpha(const std::string& endpoint, int count) {
  const auto context = net::open_context().value();
  const auto socket = net::open_socket(context.get(), ZMQ_DEALER).value();
  net::connect_socket(socket.get(), endpoint).value();
  net::set_option(socket.get(), ZMQ_RCVTIMEO, 10'000).value();
  constexpr int kUnderWay = 8;  // the daemon keeps sixteen replies for a client
  int sent = 0, answered = 0;
  while (answered < count) {
    for (; sent < count && sent - answered < kUnderWay; ++sent) {
      v1::ControlRequest request;
      request.mutable_set_parameter()->set_stream("walker");
      request.mutable_set_parameter()->set_name("alpha");
      request.mutable_set_parameter()->set_number(sent % 2 == 0 ? 0.25F : 0.75F);
      if (!net::send_part(socket.get(), request.SerializeAsString(), false)) break;
    }
    net::Message reply;
    if (!reply.receive(socket.get(), 0)) return answered;
    ++answered;
  }
  return answered;
}

int flood_size() {
  const char* const wanted = std::getenv("POSED_FLOOD");  // 60000 for the long form
  return wanted == nullptr ? 3000 : std::atoi(wanted);
}

// Watches `count` frames of the walker in a separate process and determines whether any is missing.
struct Watched {
  explicit Watched(const std::string& publish, int frames)
      : count(frames),
        monitor({"monitor", "--connect", publish, "--stream", "walker", "--json", "--count",
                 std::to_string(frames)}) {
    first = sequence_of(monitor.line());
  }
  static std::uint64_t sequence_of(const std::optional<std::string>& line) {
    REQUIRE(line);
    return std::stoull(json::parse(*line).at("sequence").get<std::string>());
  }
  [[nodiscard]] int missing() {
    int missed = 0;
    for (auto line = monitor.line(); line; line = monitor.line()) {
      const std::uint64_t next = sequence_of(line);
      missed += static_cast<int>(next - first - 1);
      first = next;
    }
    CHECK(monitor.exit_code() == 0);
    return missed;
  }
  int count;
  Process monitor;
  std::uint64_t first = 0;
};

// Checks that the walker lost no frames except those that a busy machine cost, which the daemon
// counted. A thread that waits for stderr would cost all of them.
void check_nothing_lost(const Stage& stage, Watched& watched) {
  const int missing = watched.missing();
  const auto status = json::parse(stage.ctl({"--json", "status"}).out).at("status");
  const auto& walker = status.at("stream").at(0);
  const auto count = [&walker](const char* what) {
    return std::stoi(walker.at(what).get<std::string>());
  };
  CHECK(missing <= count("shed") + count("dropped"));
  CHECK(missing < watched.count / 2);
}

void stop(Stage& stage) {
  const auto begin = std::chrono::steady_clock::now();
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  WARN("SIGTERM to the end: " << took.count() << " ms");
}

}  // namespace

TEST_CASE("a stderr that nobody reads costs no frame, and SIGTERM still ends the daemon") {
  Served served;
  Pipe err;
  err.fill();
  served.launch("run", {}, {err.write_end()});
  Watched watched(served.publish, 240);
  // On another thread, because a monitor that nobody reads would itself lose frames.
  auto answered = std::async(std::launch::async, flood_alpha, served.control, flood_size());
  check_nothing_lost(served, watched);
  CHECK(answered.get() == flood_size());
  stop(served);
}

TEST_CASE("log lines that nobody read are written once somebody reads") {
  Served served;
  Pipe err;
  const std::size_t held = err.fill();
  served.launch("run", {}, {err.write_end()});
  CHECK(flood_alpha(served.control, 50) == 50);
  std::string log = err.take();
  CHECK(log.size() >= held);
  stop(served);
  log += err.take();
  CHECK(has(log.substr(held), "walker: style.alpha "));
  CHECK(has(log.substr(held), "ending"));
}

TEST_CASE("a closed stderr ends neither run nor record") {
  for (const bool recording : {false, true}) {
    Served served;
    Pipe err;
    const std::vector<std::string> options{"--out", served.path("take.plog"), "--frames"};
    served.launch(recording ? "record" : "run", recording ? options : std::vector<std::string>{},
                  {err.write_end()});
    err.close_writer();
    err.close_reader();
    CHECK(flood_alpha(served.control, 50) == 50);
    Watched watched(served.publish, 60);
    check_nothing_lost(served, watched);
    stop(served);
    if (!recording) continue;
    served.check_replay();
  }
}

TEST_CASE("started without a stderr, the log of the program does not go into the device log") {
  Served served;
  served.launch("record", {"--out", served.path("take.plog"), "--frames"}, {ChildStderr::kClosed});
  CHECK(flood_alpha(served.control, 50) == 50);
  Watched watched(served.publish, 60);
  check_nothing_lost(served, watched);
  stop(served);
  served.check_replay();
}

TEST_CASE("a flood of control messages gives a few lines a second, with their count") {
  Served served;
  served.start();
  const auto begin = std::chrono::steady_clock::now();
  CHECK(flood_alpha(served.control, flood_size()) == flood_size());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  stop(served);
  const std::string log = served.daemon->errors();
  const auto lines = std::ranges::count(log, '\n');
  INFO(log.substr(0, 4000));
  WARN(flood_size() << " requests in " << took.count() << " s: " << lines << " lines");
  CHECK(static_cast<double>(lines) < 10.0 + 3.0 * took.count());
  CHECK(has(log, "like it)"));
}

TEST_CASE("a stdout that its reader has left ends a printing command quietly") {
  Served served;
  served.start();
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"monitor", "--connect", served.publish},
           {"monitor", "--connect", served.publish, "--json"},
           {"monitor", "--connect", served.publish, "--topic", "stats"},
           {"top", "--connect", served.publish},
           {"top", "--connect", served.publish, "--json"}}) {
    Process printing(command);
    REQUIRE(printing.line());
    printing.hang_up();
    INFO(command[0]);
    CHECK(printing.exit_code() == 0);
    CHECK(printing.errors().empty());
  }
  Process short_lived({"--help"});
  short_lived.hang_up();
  CHECK(short_lived.exit_code() == 0);
  CHECK(short_lived.errors().empty());
}

}  // namespace posed::test
