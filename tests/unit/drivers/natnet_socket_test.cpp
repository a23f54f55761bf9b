// The NatNet driver over real sockets of this machine: from Connect to the first frames.
#include <catch2/catch.hpp>

#include <poll.h>

#include "drivers/natnet/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/unit/drivers/natnet_rig.hpp"

namespace posed::drivers {
namespace {

using test::NatNetBytes;

// The next datagram; empty when none comes within a second.
Chunk received(Transport& transport) {
  pollfd ready{.fd = transport.poll_fd(), .events = POLLIN, .revents = 0};
  (void)::poll(&ready, 1, 1000);
  return transport.read(0);
}

// A host opened by the driver, and the sockets of a server.
struct NatNetLine {
  std::unique_ptr<UdpTransport> server =
      UdpTransport::open({.sockets = {{.listen = "127.0.0.1:0"}}}).value();
  TransportFactory ports;
  Device device = opened();
  UdpTransport& host = dynamic_cast<UdpTransport&>(*device.transport);
  std::unique_ptr<UdpTransport> data =
      UdpTransport::open({.sockets = {{.listen = "127.0.0.1:0", .to = host.endpoint(1)}}}).value();

  Device opened() {
    auto made = find_driver("natnet")->open({{"server", server->endpoint(0)},
                                             {"listen", std::string("127.0.0.1:0")},
                                             {"unicast", true}},
                                            ports);
    if (!made) FAIL(made.error().text());
    return std::move(*made);
  }
};

}  // namespace

TEST_CASE("a NatNet server on this machine is asked who it is, and streams to the data socket") {
  NatNetLine line;
  natnet::NatNetEmulator emulator{natnet::Settings{}};
  CHECK(line.device.poll.request.empty());
  CHECK(line.device.poll.period_ns > 0);
  NatNetBytes unasked;
  emulator.emit(0, unasked);
  test::CollectSink sink;
  std::unique_ptr<const SourceLayout> layout;
  std::int64_t now_ns = 0;
  for (int turn = 0; turn < 20 && layout == nullptr; ++turn) {
    now_ns += line.device.poll.period_ns;
    const Request request = line.device.decoder->next_request(now_ns);
    if (request.bytes.empty()) continue;
    REQUIRE(line.host.send(request.bytes, request.socket));
    const Chunk question = received(*line.server);
    REQUIRE_FALSE(question.bytes.empty());
    NatNetBytes answer;
    emulator.receive(question.bytes, now_ns, answer);
    if (answer.empty()) continue;
    REQUIRE(line.server->send(answer, 0));
    const Chunk chunk = received(line.host);
    CHECK(chunk.socket == 0);
    line.device.decoder->feed_socket(chunk.socket, chunk.bytes, now_ns, sink);
    if (sink.descriptions > 0) layout = find_driver("natnet")->make_layout(sink.described).value();
  }
  REQUIRE(layout != nullptr);
  CHECK(layout->bodies[0].rate_hz == 120.0);
  line.device.decoder->use(*layout);
  for (int i = 0; i < 3; ++i) {
    NatNetBytes frame;
    emulator.emit(emulator.next_due_ns(), frame);
    REQUIRE(line.data->send(frame, 0));
    const Chunk chunk = received(line.host);
    CHECK(chunk.socket == 1);
    line.device.decoder->feed_socket(chunk.socket, chunk.bytes, now_ns, sink);
  }
  CHECK(sink.frames.size() == 6);
  CHECK(sink.samples.size() == 3);
}

TEST_CASE("without options the NatNet driver joins OptiTrack's group on this machine") {
  TransportFactory ports;
  const auto device = find_driver("natnet")->open({{"listen", std::string("0.0.0.0:0")}}, ports);
  if (!device) FAIL(device.error().text());
  CHECK(device->description.identity == "udp 127.0.0.1:1510");
}

}  // namespace posed::drivers
