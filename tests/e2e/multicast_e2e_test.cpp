// A NatNet server on another computer that sends over multicast: two network namespaces and the
// real program. The recorded session of Motive 2.1 is sent again at 120 Hz, and the network
// interface goes away and comes back.
#include <catch2/catch.hpp>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <set>
#include <thread>

#include "drivers/transport/address.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/e2e/two_hosts.hpp"
#include "tests/support/asked_again.hpp"
#include "tests/support/pcapng.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kMulticastCase = "inside two hosts: NatNet over multicast";
constexpr const char* kSession = "data/streams/natnet_python_natnet/raw/traffic.pcapng";

// Answers as the recorded server did, and sends frames to its multicast group. All on the device's
// computer, from a thread of its own.
class RecordedServer {
 public:
  RecordedServer(const TwoHosts& hosts, const std::vector<Datagram>& session) {
    for (const Datagram& datagram : session) {
      const auto id = value_at<std::uint16_t>(datagram, 0);
      if (id == kServerInfo) info_ = datagram;
      if (id == kModelDef) model_ = datagram;
      if (id == kFrame) frames_.push_back(datagram);
    }
    hosts.on_device([this] {
      command_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      data_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      const auto own = drivers::parse_endpoint(std::string(TwoHosts::kDevice) + ":1510").value();
      REQUIRE(::bind(command_, own.get(), own.size) == 0);
    });
    answers_ = std::jthread([this](const std::stop_token& stop) { answer(stop); });
  }
  ~RecordedServer() {
    answers_ = {};
    ::close(command_);
    ::close(data_);
  }
  RecordedServer(const RecordedServer&) = delete;
  RecordedServer& operator=(const RecordedServer&) = delete;

  [[nodiscard]] bool was_asked_for_bodies() const { return asked_.load(); }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }

  // Sends all frames at 120 Hz, with numbers and times that go on from one call to the next.
  void send_frames() {
    const auto group = drivers::parse_endpoint("239.255.42.99:1511").value();
    auto due = std::chrono::steady_clock::now();
    for (const Datagram& frame : frames_) {
      Datagram numbered = frame;
      const auto number = value_at<std::uint32_t>(frame, 4) + offset_;
      std::memcpy(numbered.data() + 4, &number, sizeof number);
      static_cast<void>(
          ::sendto(data_, numbered.data(), numbered.size(), 0, group.get(), group.size));
      due += std::chrono::nanoseconds(1s) / 120;
      std::this_thread::sleep_until(due);
    }
    offset_ += 100'000;
  }

 private:
  static constexpr std::uint16_t kConnect = 0, kServerInfo = 1, kAskModelDef = 4, kModelDef = 5,
                                 kFrame = 7;

  void answer(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      pollfd ready{.fd = command_, .events = POLLIN, .revents = 0};
      if (::poll(&ready, 1, 50) <= 0) continue;
      drivers::Address from;
      Datagram request(2000);
      const ssize_t got =
          ::recvfrom(command_, request.data(), request.size(), 0, from.get(), &from.size);
      if (got < 4) continue;
      std::uint16_t id = 0;  // without Catch's macros, which belong to the test's own thread
      std::memcpy(&id, request.data(), sizeof id);
      if (id != kConnect && id != kAskModelDef) continue;
      const Datagram& answer = id == kConnect ? info_ : model_;
      static_cast<void>(::sendto(command_, answer.data(), answer.size(), 0, from.get(), from.size));
      if (id == kAskModelDef) asked_ = true;
    }
  }

  Datagram info_, model_;
  std::vector<Datagram> frames_;
  std::uint32_t offset_ = 0;
  int command_ = -1, data_ = -1;
  std::atomic<bool> asked_{false};
  std::jthread answers_;
};

void wait_for_stream(const Stage& stage, const std::string& stream) {
  for (int i = 0; i < 50; ++i) {
    if (stage.ctl({"status"}).out.find(stream) != std::string::npos) return;
    std::this_thread::sleep_for(100ms);
  }
  FAIL("no stream " << stream);
}

}  // namespace

TEST_CASE("NatNet from another computer over multicast, with an interface that goes and returns") {
  const auto recording = shared(kSession);
  if (!recording) SKIP_WITHOUT_SHARED();
  if (std::system("unshare --user --map-root-user --net ip link add a0 type veth peer name a1 "
                  "2>/dev/null") != 0) {
    WARN("SKIPPED: no network namespaces here");
    return;
  }
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command =
      "unshare --user --map-root-user --net '" + self + "' '" + kMulticastCase + "' >&2";
  // A busy machine may lose a datagram of the thousand.
  CHECK(asked_again([&] { return std::system(command.c_str()); },
                    [](int code) { return code == 0; }) == 0);
}

TEST_CASE("inside two hosts: NatNet over multicast", "[.]") {
  const TwoHosts hosts;
  RecordedServer server(hosts, datagrams_of(file_bytes(shared(kSession).value())));
  REQUIRE(server.frames() == 518);
  Stage stage;
  stage.folder.write("posed.toml", std::string(Stage::kEndpoints) +
                                       "[[source]]\nname = \"stage\"\ndriver = \"natnet\"\n"
                                       "streams = \"all\"\n[source.natnet]\nserver = \"" +
                                       TwoHosts::kDevice + "\"\ninterface = \"stage0\"\n");
  stage.record();
  wait_for_stream(stage, "stage-racequad");
  CHECK(server.was_asked_for_bodies());
  server.send_frames();
  hosts.unplug();
  server.send_frames();  // nobody hears them
  hosts.plug();
  std::this_thread::sleep_for(3s);  // the group is joined again every two seconds
  server.send_frames();
  std::this_thread::sleep_for(200ms);
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  std::set<std::uint64_t> sequences;
  check_frames_follow(stage.path("take.plog"), "stage-racequad",
                      [&](const v1::Frame& frame) { sequences.insert(frame.sequence()); });
  CHECK(sequences.size() == 2 * server.frames());
}

}  // namespace posed::test
