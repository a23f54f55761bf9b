// How much one connection without a key can load the daemon. Short here; POSED_FLOOD_SECONDS makes
// each attack longer.
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

#include "posed/v1/control.pb.h"
#include "tests/support/asked_again.hpp"
#include "tests/untrusted/target.hpp"

namespace posed::test {
namespace {

double attack_seconds() {
  const char* wanted = std::getenv("POSED_FLOOD_SECONDS");
  return wanted == nullptr ? 2.0 : std::atof(wanted);
}

struct Damage {
  double growth_MB = 0.0;
  double longest_s = 0.0;
  std::uint64_t lost = 0;
};

// Runs the attack on a new daemon. `work` is called repeatedly and sends a little each time; a peer
// that is cut off reconnects.
Damage attack(const std::function<void(const Target&)>& work) {
  Target target;
  target.start();
  Innocent innocent(target.publish);
  Damage damage;
  damage.growth_MB = target.growth_MB(attack_seconds(), [&] {
    work(target);
    return true;
  });
  CHECK(innocent.receives(10));
  innocent.stop();
  CHECK(target.ctl({"status"}).code == 0);
  CHECK_FALSE(target.daemon->exit_code(std::chrono::milliseconds(0)));
  damage.longest_s = innocent.longest_s();
  damage.lost = innocent.lost;
  return damage;
}

void check_bounded(const char* what, const std::function<void(const Target&)>& work) {
  const Damage damage =
      asked_again([&] { return attack(work); },
                  [](const Damage& one) { return one.lost == 0 && one.longest_s <= kMaxWait_s; });
  std::printf("%s: memory +%.1f MB, longest wait %.3f s, lost %llu\n", what, damage.growth_MB,
              damage.longest_s, static_cast<unsigned long long>(damage.lost));
  CHECK(damage.growth_MB < kMaxGrowth_MB);
  CHECK(damage.lost == 0);
  CHECK(damage.longest_s <= kMaxWait_s);
}

// A peer that reconnects whenever it is cut off.
class Persistent {
 public:
  explicit Persistent(const char* socket_type) : socket_type_(socket_type) {}
  void send(const std::string& endpoint, std::string_view bytes) {
    if (!peer_) {
      peer_.emplace(endpoint);
      if (!peer_->shake_hands(socket_type_)) return peer_.reset();
    }
    if (!peer_->send(bytes, std::chrono::milliseconds(20))) peer_.reset();
  }

 private:
  const char* socket_type_;
  std::optional<RawPeer> peer_;
};

// Repeats the bytes up to about 64 KB.
std::string repeated(std::string_view bytes) {
  std::string all;
  while (all.size() < 65536) all += bytes;
  return all;
}

TEST_CASE("endless messages do not fill the memory of the publisher") {
  Persistent peer("SUB");
  const std::string parts = repeated(zmtp::frame("", 1));
  check_bounded("endless parts to publish",
                [&](const Target& target) { peer.send(target.publish, parts); });
}

TEST_CASE("endless messages do not fill the memory of control") {
  Persistent peer("DEALER");
  const std::string parts = repeated(zmtp::frame("", 1));
  check_bounded("endless parts to control",
                [&](const Target& target) { peer.send(target.control, parts); });
}

TEST_CASE("large messages do not fill the memory of the publisher") {
  check_bounded("large messages to publish", [](const Target& target) {
    const RawPeer peer(target.publish);
    if (!peer.shake_hands("SUB")) return;
    std::string head("\2\0\0\0\0\x40\0\0\0", 9);  // a part of 1 GiB
    if (peer.send(head))
      (void)peer.send(std::string(4'000'000, 'x'), std::chrono::milliseconds(50));
  });
}

TEST_CASE("unfinished handshakes do not fill the memory") {
  std::vector<RawPeer> peers;
  const Target* attacked = nullptr;
  check_bounded("unfinished handshakes to control", [&](const Target& target) {
    if (attacked != &target || peers.size() > 40) peers.clear();
    attacked = &target;
    peers.emplace_back(target.control);
    std::string bytes = zmtp::greeting();
    bytes += std::string("\6\0\0\0\0\3\xff\0\0", 9);  // a command of 64 MiB
    bytes += std::string(3'000'000, 'x');
    (void)peers.back().send(bytes, std::chrono::milliseconds(50));
  });
}

TEST_CASE("random subscriptions do not affect other clients") {
  Persistent peer("SUB");
  std::mt19937 random(5);
  check_bounded("random subscriptions", [&](const Target& target) {
    std::string bytes;
    for (int i = 0; i < 70; ++i) {
      std::string topic(480, '\0');
      for (char& sign : topic) sign = static_cast<char>(random());
      bytes += zmtp::subscribe(topic);
    }
    peer.send(target.publish, bytes);
  });
}

TEST_CASE("subscriptions to streams that do not exist are limited") {
  Persistent peer("SUB");
  std::mt19937 random(6);
  check_bounded("subscriptions to possible streams", [&](const Target& target) {
    std::string bytes;
    for (int i = 0; i < 1000; ++i) {
      std::string topic = "pose/" + std::string(32, 'a');
      for (std::size_t k = 5; k < topic.size(); ++k)
        topic[k] = static_cast<char>('a' + random() % 26);
      bytes += zmtp::subscribe(topic);
    }
    peer.send(target.publish, bytes);
  });
}

TEST_CASE("repeated requests for skeletons do not affect other clients") {
  Persistent peer("SUB");
  const std::string asked = repeated(zmtp::subscribe("skeleton/"));
  check_bounded("skeletons over and over",
                [&](const Target& target) { peer.send(target.publish, asked); });
}

TEST_CASE("requests with invalid texts do not flood the log") {
  Target target;
  target.start();
  v1::ControlRequest request;
  request.mutable_set_parameter()->set_stream("walker");
  request.mutable_set_parameter()->set_name("alpha");
  std::string damaged = request.SerializeAsString();
  damaged[damaged.find("walker")] = '\xff';
  const RawPeer peer(target.control);
  REQUIRE(peer.shake_hands("DEALER"));
  for (int i = 0; i < 300; ++i) {
    INFO(target.daemon->errors());
    REQUIRE(peer.send(zmtp::frame(damaged)));
    REQUIRE_FALSE(peer.receive(1).empty());  // refused, with an error message to the client
  }
  CHECK(target.daemon->errors().size() < 2000);
}

TEST_CASE("requests whose replies nobody reads do not fill the memory") {
  Persistent peer("DEALER");
  v1::ControlRequest status;
  status.mutable_status();
  const std::string asked = repeated(zmtp::frame(status.SerializeAsString()));
  check_bounded("unread answers", [&](const Target& target) { peer.send(target.control, asked); });
}

}  // namespace
}  // namespace posed::test
