// A device that sends valid data as fast as the network allows must neither disturb other streams
// nor exhaust the daemon's memory.
#include <catch2/catch.hpp>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <set>
#include <string>
#include <thread>

#include "drivers/driver.hpp"
#include "drivers/options.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/log/reader.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/asked_again.hpp"
#include "tests/support/free_port.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

constexpr double kNeighbourRate_hz = 120.0;

// 2 s, or POSED_FLOOD_S seconds.
std::chrono::milliseconds flood_time() {
  const char* const wanted = std::getenv("POSED_FLOOD_S");
  return wanted == nullptr ? 2000ms : std::chrono::milliseconds(1000 * std::atoi(wanted));
}

std::string glove_lines(std::size_t bytes) {
  const drivers::Driver& driver = *drivers::find_driver("lucidgloves");
  const auto glove = driver.emulate(drivers::complete_options(driver, {}).value()).value();
  drivers::Emulator::Bytes line;
  glove->emit(0, line);
  std::string lines;
  while (lines.size() < bytes) {
    lines.append(reinterpret_cast<const char*>(line.data()), line.size());  // NOLINT: as text
  }
  return lines;
}

// A glove that connects and sends without a pause until the time is over.
std::uint64_t flood(std::uint16_t port, std::chrono::milliseconds time) {
  const std::string lines = glove_lines(64 * 1024);
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  const timeval patience{.tv_sec = 1, .tv_usec = 0};
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  std::uint64_t sent = 0;
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {  // NOLINT
    const auto end = SteadyClock::now() + time;
    while (SteadyClock::now() < end) {
      const ssize_t took = ::send(fd, lines.data(), lines.size(), MSG_NOSIGNAL);
      if (took > 0) sent += static_cast<std::uint64_t>(took);
    }
  }
  ::close(fd);
  return sent;
}

std::uint64_t resident_bytes(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

// The sequence numbers of one stream's frames that a subscriber receives within a time.
std::set<std::uint64_t> frames_within(const std::string& endpoint, const std::string& stream,
                                      std::chrono::milliseconds time) {
  const auto context = net::open_context().value();
  const auto socket = net::open_socket(context.get(), ZMQ_SUB).value();
  REQUIRE(net::set_option(socket.get(), ZMQ_SUBSCRIBE, "pose/" + stream));
  REQUIRE(net::connect_socket(socket.get(), endpoint));
  std::set<std::uint64_t> sequences;
  net::Message message;
  v1::Frame frame;
  for (const auto end = SteadyClock::now() + time; SteadyClock::now() < end;) {
    zmq_pollitem_t wait{socket.get(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&wait, 1, 50) <= 0) continue;
    while (message.receive(socket.get())) {
      if (message.more()) continue;
      REQUIRE(
          frame.ParseFromArray(message.bytes().data(), static_cast<int>(message.text().size())));
      sequences.insert(frame.sequence());
    }
  }
  return sequences;
}

// A stream `walker` of 120 Hz, and a stream `flood` to which a glove can connect at this port.
std::string config_with_port(std::uint16_t port) {
  return std::string(Stage::kEndpoints) +
         "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n[stream.file]\n"
         "path = \"walk.bvh\"\nloop = true\n"
         "[[stream]]\nname = \"flood\"\ndriver = \"lucidgloves\"\n"
         "[stream.lucidgloves]\nlink = \"tcp\"\nlisten = \"127.0.0.1:" +
         std::to_string(port) + "\"\n";
}

// Records a flood, replays it, and returns what the log lacks of the neighbour.
std::uint64_t lost_by_recorded_neighbour() {
  Stage stage;
  const std::uint16_t port = free_port();
  REQUIRE(clip::write_bvh(toy_walk(240, 120.0), stage.folder.path() / "walk.bvh"));
  stage.folder.write("posed.toml", config_with_port(port));
  stage.record();
  const std::uint64_t sent = flood(port, flood_time());
  CHECK(sent > 1'000'000);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const std::string file = stage.path("take.plog");
  const auto log = log::Reader::open(file);
  REQUIRE(log);
  const auto gaps = log->gaps();
  REQUIRE(gaps);
  std::uint64_t lost = 0;
  for (const log::GapRow& gap : *gaps) {
    if (gap.owner != 1) lost += gap.lost;
  }
  const ProgramOutcome replay = posed({"replay", file, "--speed", "max", "--expect", "--json"});
  INFO(replay.err);
  WARN("the glove sent " << sent / 1'000'000 << " MB; replay says " << replay.out);
  REQUIRE(replay.code == 0);
  CHECK(nlohmann::json::parse(replay.out).at("compared") > 100);
  return lost;
}

// What a subscriber of the neighbour sees during a flood.
struct Neighbour {
  std::size_t came = 0, expected = 0;  // frames
  std::chrono::milliseconds time;
  std::uint64_t dropped = 0;

  [[nodiscard]] bool undisturbed() const {
    const double due = kNeighbourRate_hz * std::chrono::duration<double>(time).count();
    return dropped == 0 && static_cast<double>(expected) > 0.8 * due &&
           static_cast<double>(came) >= 0.95 * static_cast<double>(expected);
  }
};

Neighbour neighbour_of_flood() {
  Stage stage;
  const std::uint16_t port = free_port();
  REQUIRE(clip::write_bvh(toy_walk(240, 120.0), stage.folder.path() / "walk.bvh"));
  stage.folder.write("posed.toml", config_with_port(port));
  stage.launch("run");
  const auto before = frames_within(stage.publish, "walker", 500ms);
  REQUIRE(before.size() > 20);
  const std::uint64_t memory_before = resident_bytes(stage.daemon->pid());

  const auto time = flood_time();
  std::uint64_t sent = 0;
  std::jthread glove([&] { sent = flood(port, time + 500ms); });
  std::this_thread::sleep_for(500ms);  // the daemon exchanges the device info with it
  const auto during = frames_within(stage.publish, "walker", time);
  const std::uint64_t memory = resident_bytes(stage.daemon->pid());
  glove.join();

  REQUIRE(!during.empty());
  const std::uint64_t span = *during.rbegin() - *during.begin() + 1;
  const auto status = nlohmann::json::parse(stage.ctl({"--json", "status"}).out).at("status");
  WARN("the glove sent " << sent / 1'000'000 << " MB; " << during.size() << " of " << span
                         << " frames of its neighbour came; posed had " << memory_before / 1'000'000
                         << " MB, then " << memory / 1'000'000);
  CHECK(sent > 1'000'000);
  CHECK(memory < memory_before + 64U * 1024 * 1024);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  return {.came = during.size(),
          .expected = span,
          .time = time,
          .dropped = std::stoull(status.at("stream").at(0).value("dropped", "0"))};
}

}  // namespace

// The log of a flood replays bit for bit as far as it goes; only data of the flooding stream is
// missing.
TEST_CASE("a glove that floods a recording daemon loses nothing of its neighbour's log") {
  CHECK(asked_again(lost_by_recorded_neighbour, [](auto lost) { return lost == 0; }) == 0);
}

TEST_CASE("a glove that floods the daemon over TCP loses no frame of its neighbour") {
  const auto seen =
      asked_again(neighbour_of_flood, [](const Neighbour& one) { return one.undisturbed(); });
  INFO(seen.came << " of " << seen.expected << " frames came, " << seen.dropped << " dropped");
  CHECK(seen.undisturbed());
}

}  // namespace posed::test
