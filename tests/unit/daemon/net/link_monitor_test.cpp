// Connections that were made to a daemon, when somebody else has its port: their memory is bounded.
#include <catch2/catch.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/transport/subscription.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/zmq/link_monitor.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/support/raw_listener.hpp"

namespace posed::net {
namespace {

using namespace std::chrono_literals;

// A subscriber, and somebody who has the port that it connects to.
struct Linked {
  test::RawListener impostor;
  Context context = *open_context();
  Socket socket = *open_socket(context.get(), ZMQ_SUB);
  std::unique_ptr<LinkMonitor> link = *LinkMonitor::open(context.get(), socket.get(), false);

  Linked() {
    REQUIRE(set_option(socket.get(), ZMQ_SUBSCRIBE, ""));
    REQUIRE(set_option(socket.get(), ZMQ_RCVHWM, 16));
    REQUIRE(set_option(socket.get(), ZMQ_RCVBUF, 16 * 1024));
    REQUIRE(connect_socket(socket.get(), impostor.endpoint()));
  }
  // The next part, waited for.
  [[nodiscard]] std::string next() const {
    Message part;
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!link->receive(part)) {
      if (std::chrono::steady_clock::now() > end) return "(nothing came)";
      std::this_thread::sleep_for(1ms);
    }
    return std::string(part.text());
  }
  // Lets the peer send parts of a message that never ends.
  [[nodiscard]] test::RawPeer hold(std::size_t bytes) const {
    auto peer = impostor.accept();
    REQUIRE(peer.shake_hands("PUB"));
    REQUIRE(peer.send(test::repeated(test::zmtp::frame("", 1), bytes)));
    return peer;
  }
  // Whether it is cut within the time.
  [[nodiscard]] bool cut(std::chrono::milliseconds time) const {
    const auto end = std::chrono::steady_clock::now() + time;
    while (link->cuts() == 0 && std::chrono::steady_clock::now() < end) {
      static_cast<void>(link->next_refusal());
      std::this_thread::sleep_for(1ms);
    }
    return link->cuts() > 0;
  }
};

TEST_CASE("a message that never ends costs its sender the connection, whatever its parts are") {
  for (const std::size_t part : {0, 200, 100'000}) {
    INFO("parts of " << part << " bytes");
    const Linked linked;
    const auto peer = linked.impostor.accept();
    REQUIRE(peer.shake_hands("PUB"));
    const std::string parts = test::repeated(test::zmtp::frame(std::string(part, 'x'), 1), 64'000);
    // Far more than is left alone. The sender notices that it was cut.
    std::size_t sent = 0;
    while (sent < 256'000'000 && peer.send(parts)) sent += parts.size();
    CHECK(sent < 256'000'000);
    static_cast<void>(linked.link->next_refusal());
    CHECK(linked.link->cuts() > 0);
  }
}

TEST_CASE("one part that is too large costs the connection before it is received") {
  const Linked linked;
  const auto peer = linked.impostor.accept();
  REQUIRE(peer.shake_hands("PUB"));
  const std::string head("\x02\0\0\0\0\x7f\0\0\0", 9);  // 2 GB follow
  static_cast<void>(peer.send(head + std::string(4096, 'x')));
  CHECK(peer.hung_up());
}

TEST_CASE("who receives what comes keeps the connection, however much it is") {
  const Linked linked;
  const auto peer = linked.impostor.accept();
  REQUIRE(peer.shake_hands("PUB"));
  const std::string part(60'000, 'x');
  std::atomic<bool> sent_all{true};
  std::thread sender([&] {
    for (int i = 0; i < 200 && sent_all; ++i) {
      sent_all = peer.send(test::zmtp::frame("stats", 1) + test::zmtp::frame(part));
    }
  });
  int received = 0;
  for (; received < 200; ++received) {
    if (linked.next() != "stats" || linked.next().size() != part.size()) break;
  }
  CHECK(received == 200);
  sender.join();
  CHECK(sent_all);
  CHECK(linked.link->next_refusal() == Refusal::kNone);
  CHECK(linked.link->cuts() == 0);
  CHECK(linked.link->established());
}

TEST_CASE("whole messages before it gain a message without an end no room") {
  const Linked linked;
  const auto peer = linked.impostor.accept();
  REQUIRE(peer.shake_hands("PUB"));
  std::string bytes;
  for (int i = 0; i < 10; ++i) bytes += test::zmtp::frame(std::string(10'000, 'x'));
  REQUIRE(peer.send(bytes));
  const std::string parts = test::repeated(test::zmtp::frame("", 1), 64'000);
  // Each message is received only when more of the one without an end has come.
  std::size_t sent = 0;
  for (int i = 0; i < 10; ++i) {
    REQUIRE(linked.next().size() == 10'000);
    for (int more = 0; more < 40 && peer.send(parts, 200ms); ++more) sent += parts.size();
  }
  CHECK(sent < 12'000'000);  // far fewer than all, with what the kernel keeps for the sender
  static_cast<void>(linked.link->next_refusal());
  CHECK(linked.link->cuts() > 0);
}

TEST_CASE("many connections one after the other bring no more than one while nothing is received") {
  const Linked linked;
  const std::string parts = test::repeated(test::zmtp::frame("", 1), 100'000);
  std::size_t whole = 0;
  for (int i = 0; i < 12; ++i) {
    const auto peer = linked.impostor.accept();
    if (!peer.shake_hands("PUB")) continue;
    if (peer.send(parts + test::zmtp::frame("end")) && !peer.hung_up(50ms)) ++whole;
  }
  CHECK(whole < 8);
  // That this side ended them is no refusal.
  CHECK(linked.link->next_refusal() == Refusal::kNone);
  CHECK(linked.link->cuts() > 0);
  // Once all of it was received, a new connection is as good as the first.
  Message part;
  while (linked.link->receive(part)) {
  }
  for (bool heard = false; !heard;) {
    const auto peer = linked.impostor.accept();
    if (!peer.shake_hands("PUB") || !peer.send(test::zmtp::frame("hello"))) continue;
    const auto end = std::chrono::steady_clock::now() + 1s;
    while (!heard && std::chrono::steady_clock::now() < end) {
      if (linked.link->receive(part)) heard = part.text() == "hello";
    }
  }
  CHECK(part.text() == "hello");
}

TEST_CASE("what waits in all links together is bounded, and those with the least keep it") {
  const Linked honest;
  const auto sender = honest.impostor.accept();
  REQUIRE(sender.shake_hands("PUB"));
  REQUIRE(sender.send(test::zmtp::frame("stats", 1) + test::zmtp::frame(std::string(8'000, 'x'))));
  {
    // Together 2.1 MB: two of them at least have to go.
    const std::array<Linked, 7> hostile;
    std::vector<test::RawPeer> peers;
    for (const Linked& each : hostile) peers.push_back(each.hold(300'000));
    int cuts = 0;
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (cuts < 2 && std::chrono::steady_clock::now() < end) {
      cuts = 0;
      for (const Linked& each : hostile) cuts += each.cut(1ms) ? 1 : 0;
    }
    CHECK(cuts >= 2);
  }
  // Links that are gone take nothing of the others' room.
  const Linked first;
  const Linked second;
  const auto peer_of_first = first.hold(1'200'000);
  CHECK_FALSE(first.cut(200ms));
  const auto peer_of_second = second.hold(600'000);
  CHECK(first.cut(10s));
  CHECK_FALSE(second.cut(50ms));
  CHECK(honest.next() == "stats");
  CHECK(honest.next().size() == 8'000);
  CHECK_FALSE(honest.cut(1ms));
}

TEST_CASE("a driver's connection to another posed is guarded, too") {
  test::RawListener impostor;
  drivers::TransportFactory ports;
  std::atomic<std::size_t> sent{0};
  std::thread flood([&] {
    const auto peer = impostor.accept();
    if (!peer.shake_hands("PUB")) return;
    const std::string parts = test::repeated(test::zmtp::frame("", 1), 64'000);
    while (sent < 64'000'000 && peer.send(parts)) sent += parts.size();
  });
  const auto transport = ports.subscribe({.endpoint = impostor.endpoint(), .topics = {"pose/ann"}});
  flood.join();
  REQUIRE(transport);
  CHECK((sent > 0 && sent < 64'000'000));
  // The link ends, and the device's supervisor tries again later.
  drivers::Chunk chunk;
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (!chunk.lost && std::chrono::steady_clock::now() < end) {
    chunk = (*transport)->read(0);
    std::this_thread::sleep_for(1ms);
  }
  CHECK(chunk.lost);
}

}  // namespace
}  // namespace posed::net
