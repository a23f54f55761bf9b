// Endpoints of ZeroMQ sockets: their ports, and addresses of IPv6.
#include <catch2/catch.hpp>

#include <string>

#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {
namespace {

TEST_CASE("a port that does not exist is refused, however it is written") {
  const Context context = open_context().value();
  for (const char* port : {"-1", "65536", "99999", "+80", "80x", "", "0x50", " 80"}) {
    const std::string endpoint = std::string("tcp://127.0.0.1:") + port;
    INFO(endpoint);
    CHECK_FALSE(has_possible_port(endpoint));
    const Socket socket = open_socket(context.get(), ZMQ_PUB).value();
    const auto bound = bind_socket(socket.get(), endpoint);
    REQUIRE_FALSE(bound);
    CHECK(bound.error().exit_code == ExitCode::kWrongUse);
    CHECK_FALSE(connect_socket(socket.get(), endpoint));
  }
  for (const char* endpoint : {"tcp://127.0.0.1:*", "tcp://[::1]:5570", "ipc:///run/posed"}) {
    CHECK(has_possible_port(endpoint));
  }
}

TEST_CASE("a socket can listen on an address of IPv6 and be connected to") {
  const Context context = open_context().value();
  const Socket server = open_socket(context.get(), ZMQ_PAIR).value();
  const auto bound = bind_socket(server.get(), "tcp://[::1]:*");
  INFO((bound ? "" : bound.error().text()));
  REQUIRE(bound);
  const Socket client = open_socket(context.get(), ZMQ_PAIR).value();
  REQUIRE(connect_socket(client.get(), *bound));
  Message part;
  REQUIRE(send_part(client.get(), "hello", false));
  REQUIRE(part.receive(server.get(), 0));
  CHECK(part.text() == "hello");
}

}  // namespace
}  // namespace posed::net
