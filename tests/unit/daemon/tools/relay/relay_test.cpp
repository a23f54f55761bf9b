#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/system/clock.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/tools/relay/relay.hpp"
#include "tests/support/raw_listener.hpp"

namespace posed::relay {
namespace {

// Upstreams that the test speaks for, a relay that the test turns, and subscribers.
class RelayRig {
 public:
  explicit RelayRig(std::size_t upstreams = 1) {
    RelayOptions options;
    options.context = context.get();
    options.endpoint = "tcp://127.0.0.1:*";
    for (std::size_t i = 0; i < upstreams; ++i) {
      daemons.push_back(net::open_socket(context.get(), ZMQ_XPUB).value());
      REQUIRE(net::set_option(daemons[i].get(), ZMQ_XPUB_VERBOSER, 1));
      const auto endpoint = net::bind_socket(daemons[i].get(), "tcp://127.0.0.1:*").value();
      options.from.push_back({.endpoint = endpoint});
    }
    received.resize(upstreams);
    relay = Relay::open(options).value();
  }
  // A relay of an endpoint where there is no daemon yet.
  explicit RelayRig(const std::string& endpoint) : received(1) {
    relay = Relay::open({.context = context.get(),
                         .from = {{.endpoint = endpoint}},
                         .endpoint = "tcp://127.0.0.1:*"})
                .value();
  }

  net::Socket subscriber(const std::string& prefix) {
    auto socket = net::open_socket(context.get(), ZMQ_SUB).value();
    REQUIRE(net::set_option(socket.get(), ZMQ_SUBSCRIBE, prefix));
    REQUIRE(net::connect_socket(socket.get(), relay->endpoint()));
    return socket;
  }

  // Turns the relay, and hears what comes to the upstreams, until `done` or ten seconds are over.
  template <typename Done>
  bool until(Done&& done) {
    const std::int64_t end_ns = system::monotonic_ns() + 10 * kNanosPerSecond;
    while (system::monotonic_ns() < end_ns) {
      static_cast<void>(relay->turn(system::monotonic_ns() + ahead_ns));
      for (std::size_t i = 0; i < daemons.size(); ++i) {
        net::Message message;
        while (message.receive(daemons[i].get())) {
          const std::string prefix(message.text().substr(1));
          if (message.text().front() == '\1')
            ++received[i][prefix];
          else
            --received[i][prefix];
        }
      }
      if (done()) return true;
      relay->wait(1'000'000);
    }
    return false;
  }
  // Waits until an upstream has heard that the relay subscribes to this.
  bool subscribes(const std::string& prefix, std::size_t upstream = 0) {
    return until([&] { return received[upstream][prefix] > 0; });
  }

  void publish(const std::string& topic, const std::string& body, std::size_t upstream = 0) {
    REQUIRE(net::send_part(daemons[upstream].get(), topic, true));
    REQUIRE(net::send_part(daemons[upstream].get(), body, false));
  }

  // The next message of a subscriber, "topic=body"; empty after ten seconds.
  std::string next(const net::Socket& socket) {
    std::string text;
    static_cast<void>(until([&] {
      net::Message topic;
      net::Message body;
      if (!topic.receive(socket.get()) || !body.receive(socket.get(), 0)) return false;
      text = std::string(topic.text()) + "=" + std::string(body.text());
      return true;
    }));
    return text;
  }

  net::Context context = net::open_context().value();
  std::vector<net::Socket> daemons;
  std::vector<std::map<std::string, int>> received;  // [upstream] subscriptions by prefix
  std::unique_ptr<Relay> relay;
  std::int64_t ahead_ns = 0;  // of the relay's clock
};

TEST_CASE("a relay passes on what its subscribers want, and subscribes to nothing else") {
  RelayRig rig;
  REQUIRE(rig.subscribes("skeleton/"));
  REQUIRE(rig.subscribes("stats"));
  const auto first = rig.subscriber("pose/ann");
  const auto second = rig.subscriber("pose/ann");
  REQUIRE(rig.subscribes("pose/ann"));
  rig.publish("pose/ann", "1");
  CHECK(rig.next(first) == "pose/ann=1");
  CHECK(rig.next(second) == "pose/ann=1");
  CHECK(rig.received[0]["pose/ann"] == 1);  // once for both
  CHECK(rig.received[0].size() == 3);
  CHECK(rig.relay->counts().messages == 1);
  CHECK(rig.relay->counts().upstreams == 1);
}

TEST_CASE("who subscribes before the relay knows the rate goes on to hear everything") {
  RelayRig rig;
  const auto early = rig.subscriber("pose/ann");
  REQUIRE(rig.subscribes("pose/ann"));
  // The length of the queues is settled after the first second, here at 200 messages.
  for (int i = 0; i < 500; ++i) {
    const std::string number = std::to_string(i);
    rig.publish("pose/ann", number);
    REQUIRE(rig.next(early) == "pose/ann=" + number);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

TEST_CASE("a subscription ends upstream when its last subscriber has gone") {
  RelayRig rig;
  std::optional<net::Socket> first = rig.subscriber("pose/ann");
  std::optional<net::Socket> second = rig.subscriber("pose/ann");
  REQUIRE(rig.until([&] { return rig.relay->counts().subscribers == 2; }));
  REQUIRE(rig.subscribes("pose/ann"));
  first.reset();
  REQUIRE(rig.until([&] { return rig.relay->counts().subscribers == 1; }));
  CHECK(rig.received[0]["pose/ann"] == 1);
  second.reset();
  CHECK(rig.until([&] { return rig.received[0]["pose/ann"] == 0; }));
}

TEST_CASE("a subscriber that comes later gets the skeleton without the upstream's help") {
  RelayRig rig;
  REQUIRE(rig.subscribes("skeleton/"));
  rig.publish("skeleton/ann", "bones");
  REQUIRE(rig.until([&] { return rig.relay->counts().messages == 1; }));
  const auto late = rig.subscriber("skeleton/ann");
  CHECK(rig.next(late) == "skeleton/ann=bones");
  CHECK(rig.relay->counts().late_skeletons >= 1);
}

TEST_CASE("messages that are not posed's are dropped and counted") {
  RelayRig rig;
  const auto all = rig.subscriber("");
  REQUIRE(rig.subscribes(""));
  rig.publish("Pose/ann", "1");
  rig.publish("pose/", "1");
  rig.publish("stats", "\xFF");
  REQUIRE(net::send_part(rig.daemons[0].get(), "pose/ann", false));  // without a body
  REQUIRE(net::send_part(rig.daemons[0].get(), "pose/ann", true));
  REQUIRE(net::send_part(rig.daemons[0].get(), "1", true));
  REQUIRE(net::send_part(rig.daemons[0].get(), "2", false));
  rig.publish("pose/ann", std::string(link::kMaxStreamMessage + 1, 'x'));
  rig.publish("pose/ann", "good");
  CHECK(rig.next(all) == "pose/ann=good");
  CHECK(rig.relay->counts().foreign == 6);
}

TEST_CASE("streams of two upstreams come through one relay; a name that both have is not mixed") {
  RelayRig rig(2);
  const auto all = rig.subscriber("pose/");
  REQUIRE(rig.subscribes("pose/", 0));
  REQUIRE(rig.subscribes("pose/", 1));
  rig.publish("pose/ann", "1", 0);
  CHECK(rig.next(all) == "pose/ann=1");
  rig.publish("pose/ann", "2", 1);
  rig.publish("pose/bob", "3", 1);
  CHECK(rig.next(all) == "pose/bob=3");
  CHECK(rig.relay->counts().clashes == 1);
  CHECK(rig.relay->counts().streams == 2);
}

TEST_CASE("a relay returns to its daemon whatever had the daemon's port meanwhile") {
  const std::string kind = GENERATE("REP", "PUB");
  INFO(kind);
  auto impostor = std::make_unique<test::RawListener>();
  const std::string endpoint = impostor->endpoint();
  RelayRig rig(endpoint);
  const auto subscriber = rig.subscriber("pose/ann");
  REQUIRE(rig.until([&] { return rig.relay->counts().subscriptions == 1; }));
  {
    const test::RawPeer peer = impostor->accept();
    impostor.reset();
    static_cast<void>(peer.shake_hands(kind));
    if (kind == "PUB") {  // a part that is too large
      REQUIRE(rig.until([&] { return rig.relay->counts().upstreams == 1; }));
      static_cast<void>(peer.send(test::zmtp::frame(std::string(2 * net::kMaxReceivedPart, 'x'))));
    }
    REQUIRE(rig.until([&] { return peer.hung_up(std::chrono::milliseconds(1)); }));
  }
  REQUIRE(rig.until([&] { return rig.relay->counts().upstreams == 0; }));
  rig.daemons.push_back(net::open_socket(rig.context.get(), ZMQ_XPUB).value());
  REQUIRE(net::bind_socket(rig.daemons[0].get(), endpoint));
  rig.ahead_ns = link::Retry::kPause_ns + kNanosPerSecond;
  REQUIRE(rig.subscribes("stats"));
  REQUIRE(rig.subscribes("pose/ann"));
  rig.publish("pose/ann", "1");
  CHECK(rig.next(subscriber) == "pose/ann=1");
}

TEST_CASE("a flood of subscriptions is cut, and nothing of it stays upstream") {
  RelayRig rig;
  REQUIRE(rig.subscribes("stats"));
  const auto honest = rig.subscriber("pose/ann");
  REQUIRE(rig.subscribes("pose/ann"));
  {
    const test::RawPeer flood(rig.relay->endpoint());
    REQUIRE(flood.shake_hands("SUB"));
    std::string wanted;
    for (int i = 0; i < 6000; ++i) wanted += test::zmtp::subscribe("pose/" + std::to_string(i));
    REQUIRE(flood.send(wanted));
    CHECK(rig.until([&] { return flood.hung_up(std::chrono::milliseconds(1)); }));
  }
  const auto only_ann = [&](const auto& one) {
    return one.second == (one.first == "pose/ann" || !one.first.starts_with("pose/") ? 1 : 0);
  };
  CHECK(rig.until([&] {
    const RelayCounts counts = rig.relay->counts();
    return counts.subscribers == 1 && counts.subscriptions == 1 &&
           std::ranges::all_of(rig.received[0], only_ann);
  }));
  rig.publish("pose/ann", "1");
  CHECK(rig.next(honest) == "pose/ann=1");
}

TEST_CASE("a relay wants upstreams, but not too many") {
  const auto context = net::open_context().value();
  RelayOptions options;
  options.context = context.get();
  options.endpoint = "tcp://127.0.0.1:*";
  CHECK_FALSE(Relay::open(options));
  options.from.assign(kMaxUpstreams + 1, {.endpoint = "tcp://127.0.0.1:9"});
  CHECK_FALSE(Relay::open(options));
}

}  // namespace
}  // namespace posed::relay
