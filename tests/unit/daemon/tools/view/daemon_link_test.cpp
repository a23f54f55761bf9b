// The bridge's connections to a daemon whose port somebody else had meanwhile.
#include "daemon/tools/view/daemon_link.hpp"

#include <catch2/catch.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "daemon/system/clock.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/support/raw_listener.hpp"

namespace posed::view {
namespace {

TEST_CASE("a page can control its daemon again whatever had the control port meanwhile") {
  using namespace std::chrono_literals;
  const auto context = net::open_context();
  boost::asio::io_context io;
  Hub hub({.version = "0.1"}, [](std::uint64_t, std::string_view) { return false; });
  const test::RawListener publish;
  auto impostor = std::make_unique<test::RawListener>();
  const std::string control = impostor->endpoint();
  const auto bridge = DaemonLink::open(
      io, context->get(), {.publish = {.endpoint = publish.endpoint()}, .control = control}, hub);
  REQUIRE(bridge);
  std::int64_t ahead_ns = 0;  // its clock is, of the machine's
  const auto until = [&](auto&& done) {
    const auto end = std::chrono::steady_clock::now() + 20s;
    while (!done() && std::chrono::steady_clock::now() < end) {
      (*bridge)->turn(system::monotonic_ns() + ahead_ns);
      io.poll();
      std::this_thread::sleep_for(5ms);
    }
    return done();
  };
  {
    const test::RawPeer peer = impostor->accept();
    impostor.reset();
    REQUIRE(peer.shake_hands("ROUTER"));
    static_cast<void>(peer.send(test::zmtp::frame(std::string(2 * net::kMaxReceivedPart, 'x'))));
    REQUIRE(until([&] { return peer.hung_up(1ms); }));
  }
  const auto daemon = net::open_socket(context->get(), ZMQ_ROUTER);
  REQUIRE(net::bind_socket(daemon->get(), control));
  net::Message asked;
  bool came = false;
  CHECK(until([&] {
    ahead_ns += kNanosPerSecond / 4;
    came = came || asked.receive(daemon->get());
    return came;
  }));
}

}  // namespace
}  // namespace posed::view
