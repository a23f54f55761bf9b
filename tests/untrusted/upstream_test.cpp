// Whoever has a daemon's port while it is away, and sends without end: the memory of every command
// that connects there is bounded.
#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <catch2/catch.hpp>

#include "posed/v1/control.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/support/process.hpp"
#include "tests/support/raw_listener.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/untrusted/target.hpp"

namespace posed::test {
namespace {

constexpr double kAtStart_MB = 60.0;  // a daemon that does nothing has less

double memory_MB(pid_t pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  double size = 0.0;
  double resident = 0.0;
  statm >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// Sends to each who connects, one after the other, until the end.
class Flood {
 public:
  Flood(std::string socket_type, std::string bytes)
      : socket_type_(std::move(socket_type)),
        bytes_(std::move(bytes)),
        thread_([this] { run(); }) {}
  ~Flood() {
    stop_ = true;
    thread_.join();
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  [[nodiscard]] const std::string& endpoint() const { return impostor_.endpoint(); }

  std::atomic<std::uint64_t> sent{0}, connections{0};

 private:
  void run() {
    while (!stop_) {
      try {
        const RawPeer peer = impostor_.accept();
        if (!peer.shake_hands(socket_type_)) continue;
        ++connections;
        while (!stop_ && peer.send(bytes_, std::chrono::milliseconds(500))) sent += bytes_.size();
      } catch (const std::exception&) {  // nobody connected for a while
      }
    }
  }

  std::string socket_type_, bytes_;
  RawListener impostor_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::string many_of(const std::string& text, int count) {
  std::string all;
  all.reserve(text.size() * static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

std::string bomb_of_stats() {
  return zmtp::frame("stats", 1) + zmtp::frame(many_of(std::string("\x1a\x00", 2), 1'000'000));
}

TEST_CASE("whoever has the daemon's port cannot fill the memory of those that connect to it") {
  const TempFolder folder;
  folder.write("index.html", "<p>the page");
  const std::vector<std::pair<std::string, std::string>> floods{
      {"empty parts", many_of(zmtp::frame("", 1), 64'000)},
      {"stats of empty parts", bomb_of_stats()}};
  for (const auto& [what, bytes] : floods) {
    for (const std::string command : {"run", "relay", "view", "monitor", "top", "ctl"}) {
      INFO("posed " << command << ", sent " << what);
      Flood flood(command == "ctl" ? "ROUTER" : "PUB", bytes);
      folder.write("posed.toml",
                   std::string(Stage::kEndpoints) +
                       "[[source]]\nname = \"far\"\ndriver = \"posed\"\nstreams = \"all\"\n"
                       "[source.posed]\nconnect = \"" +
                       flood.endpoint() + "\"\n");
      std::vector<std::string> arguments{command};
      if (command == "run") {
        arguments.insert(arguments.end(), {"--config", (folder.path() / "posed.toml").string()});
      } else if (command == "relay") {
        arguments.insert(arguments.end(),
                         {"--from", flood.endpoint(), "--bind", "tcp://127.0.0.1:*"});
      } else {
        arguments.insert(arguments.end(), {"--connect", flood.endpoint()});
      }
      if (command == "ctl") arguments.insert(arguments.end(), {"status", "--timeout", "3"});
      if (command == "view") {
        arguments.insert(arguments.end(), {"--port", "0", "--page", folder.path().string()});
      }
      Process process(arguments);
      // Where a daemon locks its memory it gives none back: later links use that of earlier ones.
      const std::chrono::seconds attack(command == "run" ? 4 : 2);
      const auto end = std::chrono::steady_clock::now() + attack;
      double most_MB = 0.0;
      while (std::chrono::steady_clock::now() < end) {
        most_MB = std::max(most_MB, memory_MB(process.pid()));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      CHECK(flood.connections > 0);
      CHECK(most_MB < kAtStart_MB + kMaxGrowth_MB);
      WARN(command << ", " << what << ": at most " << most_MB << " MB, " << flood.connections
                   << " connections");
    }
  }
}

// Answers each request with this reply.
class Answerer {
 public:
  explicit Answerer(const v1::ControlReply& reply)
      : reply_(reply.SerializeAsString()),
        context_(*net::open_context()),
        socket_(*net::open_socket(context_.get(), ZMQ_ROUTER)),
        endpoint_(*net::bind_socket(socket_.get(), "tcp://127.0.0.1:*")),
        thread_([this] { run(); }) {}
  ~Answerer() {
    stop_ = true;
    thread_.join();
  }
  Answerer(const Answerer&) = delete;
  Answerer& operator=(const Answerer&) = delete;
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

 private:
  void run() {
    std::vector<std::string> parts;
    while (!stop_) {
      net::Message part;
      if (!part.receive(socket_.get())) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      parts.emplace_back(part.text());
      if (part.more()) continue;
      parts.back() = reply_;
      for (const std::string& one : parts) {
        static_cast<void>(net::send_part(socket_.get(), one, &one != &parts.back()));
      }
      parts.clear();
    }
  }

  std::string reply_;
  net::Context context_;
  net::Socket socket_;
  std::string endpoint_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST_CASE("what a daemon answers cannot command the terminal of ctl") {
  const std::string hostile = "a\x1b[2J\r\x07\u202e\u009b";
  v1::ControlReply reply;
  reply.set_ok(true);
  reply.set_stream(hostile);
  reply.set_sequence(1);
  reply.mutable_take()->set_name(hostile);
  v1::KnownModel& model = *reply.add_model();
  for (std::string* text : {model.mutable_name(), model.mutable_kind(), model.mutable_learnt(),
                            model.mutable_verdict()}) {
    *text = hostile;
  }
  v1::KnownRecording& recording = *reply.add_recording();
  recording.set_name(hostile);
  recording.set_problem(hostile);
  const Answerer daemon(reply);
  const std::vector<std::vector<std::string>> commands{
      {"models"},           {"recordings"},    {"set", "a", "alpha", "1"},
      {"warm-up", "a"},     {"engage", "a"},   {"use-model", "a", "m.style"},
      {"play", "a", "g"},   {"take", "start"}, {"rename-model", "a.style", "b"},
      {"stop-playing", "a"}};
  for (const bool json : {false, true}) {
    for (const auto& command : commands) {
      INFO(command.front() << (json ? " --json" : ""));
      std::vector<std::string> words{"ctl", "--connect", daemon.endpoint()};
      if (json) words.emplace_back("--json");
      words.insert(words.end(), command.begin(), command.end());
      Process ctl(words);
      const std::string printed = ctl.rest() + ctl.errors();
      CHECK(ctl.exit_code().value_or(-1) == 0);
      CHECK_FALSE(printed.empty());
      for (const std::string code : {"\x1b", "\r", "\x07", "\u202e", "\u009b"}) {
        CHECK_FALSE(printed.contains(code));
      }
    }
  }
}

TEST_CASE("a refusal without words is said") {
  const Answerer daemon{v1::ControlReply{}};
  Process ctl({"ctl", "--connect", daemon.endpoint(), "status"});
  CHECK(ctl.exit_code().value_or(-1) == 1);
  CHECK(ctl.errors().contains("does not say why"));
}

// What had the daemon's port while it was away sent a part so large that libzmq tries no more.
TEST_CASE("who watches a daemon returns to it whatever had its port meanwhile") {
  for (const std::string command : {"monitor", "top"}) {
    INFO(command);
    auto impostor = std::make_unique<RawListener>();
    const std::string endpoint = impostor->endpoint();
    Process watches({command, "--connect", endpoint, "--json", "--count", "1"});
    {
      const RawPeer peer = impostor->accept();
      impostor.reset();
      REQUIRE(peer.shake_hands("PUB"));
      static_cast<void>(peer.send(zmtp::frame(std::string(2 * 1024 * 1024, 'x'))));
      CHECK(peer.hung_up(RawPeer::kPatience));
    }
    CHECK(watches.comes_to_say("waiting"));
    const auto context = net::open_context();
    const auto daemon = net::open_socket(context->get(), ZMQ_PUB);
    REQUIRE(net::bind_socket(daemon->get(), endpoint));
    v1::Stats stats;
    stats.set_time_ns(7);
    const v1::Frame pose;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(15);
    while (!watches.exit_code(std::chrono::milliseconds(50)) &&
           std::chrono::steady_clock::now() < end) {
      static_cast<void>(net::send_part(daemon->get(), "stats", true));
      static_cast<void>(net::send_part(daemon->get(), stats.SerializeAsString(), false));
      static_cast<void>(net::send_part(daemon->get(), "pose/a", true));
      static_cast<void>(net::send_part(daemon->get(), pose.SerializeAsString(), false));
    }
    CHECK(watches.exit_code(std::chrono::milliseconds(0)) == 0);
  }
}

TEST_CASE("who is sent more than any daemon sends says so") {
  for (const std::string command : {"monitor", "top"}) {
    INFO(command);
    const Flood flood("PUB", many_of(zmtp::frame("", 1), 64'000));
    Process watches({command, "--connect", flood.endpoint(), "--json", "--timeout", "3"});
    CHECK(watches.exit_code() == 1);
    CHECK(watches.errors().contains("more than any daemon does"));
  }
}

}  // namespace
}  // namespace posed::test
