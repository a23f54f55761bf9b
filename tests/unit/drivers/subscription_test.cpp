// The transport that subscribes to another posed: what it delivers, discards and reports.
#include <catch2/catch.hpp>

#include <poll.h>

#include <chrono>
#include <string>
#include <thread>

#include "drivers/transport/subscription.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace {

// A publisher on a free port, and a transport that subscribes to two topics of it.
struct SubscriptionRig {
  net::Context context = net::open_context().value();
  net::Socket publisher;
  std::string endpoint;
  TransportFactory ports;
  std::unique_ptr<SubscriptionTransport> transport;

  SubscriptionRig() {
    publisher = net::open_socket(context.get(), ZMQ_XPUB).value();
    REQUIRE(net::set_option(publisher.get(), ZMQ_SNDHWM, 0));
    endpoint = net::bind_socket(publisher.get(), "tcp://127.0.0.1:*").value();
    transport =
        ports.subscribe({.endpoint = endpoint, .topics = {"pose/ann", "skeleton/ann"}}).value();
    for (int i = 0; i < 2; ++i) {
      net::Message subscription;
      REQUIRE(subscription.receive(publisher.get(), 0));
    }
    REQUIRE(transport->start(0));
  }
  void publish(const std::string& topic, const std::string& body) {
    REQUIRE(net::send_part(publisher.get(), topic, true));
    REQUIRE(net::send_part(publisher.get(), body, false));
  }
  // The next chunk, waited for; `lost` and no bytes at the end of the link.
  Chunk next() {
    pollfd wait{.fd = transport->poll_fd(), .events = POLLIN, .revents = 0};
    REQUIRE(::poll(&wait, 1, 10'000) == 1);
    return transport->read(0);
  }
};

std::string text_of(const Chunk& chunk) {
  return {reinterpret_cast<const char*>(chunk.bytes.data()), chunk.bytes.size()};
}

TEST_CASE("a message becomes a chunk: topic, zero byte, body; other topics are left out") {
  SubscriptionRig rig;
  rig.publish("pose/ann-raw", "x");
  rig.publish("pose/ann", "one");
  rig.publish("skeleton/ann", "");
  CHECK(text_of(rig.next()) == std::string("pose/ann\0one", 12));
  CHECK(text_of(rig.next()) == std::string("skeleton/ann\0", 13));
  CHECK(rig.transport->read(0).bytes.empty());
}

TEST_CASE("the context of a subscription outlives its link") {
  SubscriptionRig rig;
  const std::weak_ptr<net::Context> context = subscription_context().value();
  rig.transport.reset();
  CHECK_FALSE(context.expired());
  const long users = context.use_count();
  TransportFactory other;
  auto second = other.subscribe({.endpoint = rig.endpoint, .topics = {"pose/ann"}});
  REQUIRE(second);
  CHECK(context.use_count() == users + 2);  // the factory and its link
}

TEST_CASE("when nobody reads, the newest messages stay and the others are counted") {
  SubscriptionRig rig;
  constexpr std::uint32_t kSent = 500;
  const std::string load(3000, 'x');
  for (std::uint32_t i = 1; i <= kSent; ++i) {
    rig.publish("pose/ann", load + std::to_string(i));
    if (i % 8 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // The last message tells when all have come.
  std::uint32_t dropped = 0;
  std::uint32_t read = 0;
  std::string last;
  while (last != std::to_string(kSent)) {
    const Chunk chunk = rig.next();
    dropped += chunk.kernel_dropped;
    last = text_of(chunk).substr(9 + load.size());
    ++read;
  }
  CHECK(read < kSent);
  CHECK(read > 4);
  CHECK(dropped > 0);
  CHECK(read + dropped <= kSent);  // libzmq's own short queue discards without a word
}

TEST_CASE("messages that cannot be chunks are counted") {
  SubscriptionRig rig;
  REQUIRE(net::send_part(rig.publisher.get(), "pose/ann", false));
  REQUIRE(net::send_part(rig.publisher.get(), "pose/ann", true));
  REQUIRE(net::send_part(rig.publisher.get(), "1", true));
  REQUIRE(net::send_part(rig.publisher.get(), "2", false));
  rig.publish("pose/ann", std::string(kMaxChunk - 4, 'x'));
  rig.publish("pose/ann", std::string(8 * kMaxChunk, 'x'));
  rig.publish("pose/ann", "good");
  const Chunk chunk = rig.next();
  CHECK(text_of(chunk).ends_with("good"));
  CHECK(chunk.damaged == 4);
}

TEST_CASE("the end of the connection is told behind the last message") {
  SubscriptionRig rig;
  rig.publish("pose/ann", "last");
  CHECK(text_of(rig.next()).ends_with("last"));
  rig.publisher.reset();
  const Chunk chunk = rig.next();
  CHECK(chunk.lost);
  CHECK(chunk.bytes.empty());
}

TEST_CASE("a publisher that sends megabytes of nothing of use is cut") {
  SubscriptionRig rig;
  const std::string load(60'000, 'x');
  std::size_t read = 0;
  const auto lost = [&](bool used) {
    rig.publish("pose/ann", load);
    const Chunk chunk = rig.next();
    read += chunk.bytes.size();
    if (!chunk.lost) REQUIRE(chunk.is_part_of_link());
    rig.transport->decoded(used);
    return chunk.lost;
  };
  for (int i = 0; i < 100; ++i) REQUIRE_FALSE(lost(i % 40 == 0));
  read = 0;
  while (!lost(false)) REQUIRE(read < 4'000'000);
  CHECK(rig.transport->consume_note().contains("nothing usable"));
  CHECK(rig.transport->consume_note().empty());
}

TEST_CASE("a publisher that is not there, and wrong settings, are errors that say what to do") {
  TransportFactory ports;
  const auto nobody = ports.subscribe({.endpoint = "tcp://127.0.0.1:9", .topics = {"pose/ann"}});
  REQUIRE_FALSE(nobody);
  CHECK(nobody.error().message.contains("is posed running there?"));
  CHECK_FALSE(check_subscription({.endpoint = "127.0.0.1:5570"}));
  CHECK_FALSE(check_subscription({.endpoint = "tcp://127.0.0.1:5570", .key = "/nonexistent.key"}));
  CHECK(check_subscription({.endpoint = "tcp://127.0.0.1:5570"}));
  ports.cancel();
  CHECK_FALSE(ports.subscribe({.endpoint = "tcp://127.0.0.1:9", .topics = {"pose/ann"}}));
}

}  // namespace
}  // namespace posed::drivers
