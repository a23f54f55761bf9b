// Endpoints of ZeroMQ sockets: their ports, and addresses of IPv6.
#include <catch2/catch.hpp>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "proto/zmq/zmq_handle.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::net {
namespace {

TEST_CASE("a port that does not exist is refused, however it is written") {
  const Context context = open_context().value();
  for (const char* port : {"-1", "65536", "99999", "+80", "80x", "", "0x50", " 80", "00"}) {
    const std::string endpoint = std::string("tcp://127.0.0.1:") + port;
    INFO(endpoint);
    CHECK_FALSE(check_endpoint(endpoint));
    const Socket socket = open_socket(context.get(), ZMQ_PUB).value();
    const auto bound = bind_socket(socket.get(), endpoint);
    REQUIRE_FALSE(bound);
    CHECK(bound.error().exit_code == ExitCode::kWrongUse);
    CHECK_FALSE(connect_socket(socket.get(), endpoint));
  }
  for (const char* endpoint : {"tcp://127.0.0.1:*", "tcp://[::1]:5570", "ipc:///run/posed"}) {
    CHECK(check_endpoint(endpoint));
  }
}

TEST_CASE("nobody waits for a daemon where none can be") {
  const Context context = open_context().value();
  for (const char* endpoint : {"tcp://127.0.0.1:0", "inproc://x", "ws://127.0.0.1:5570/",
                               "udp://127.0.0.1:5570", "norm://1,127.0.0.1:5", "", "%s%n"}) {
    INFO(endpoint);
    const Socket socket = open_socket(context.get(), ZMQ_SUB).value();
    const auto connected = connect_socket(socket.get(), endpoint);
    REQUIRE_FALSE(connected);
    CHECK(connected.error().exit_code == ExitCode::kWrongUse);
  }
}

TEST_CASE("no file that is there gives way to a socket, and no socket that is listened to") {
  const test::TempFolder folder;
  const Context context = open_context().value();
  const auto bind = [&](const std::string& path, Socket& socket) {
    socket = open_socket(context.get(), ZMQ_PUB).value();
    return bind_socket(socket.get(), "ipc://" + path);
  };
  Socket first, second;
  const std::string precious = folder.write("precious.plog", "a recording").string();
  CHECK(bind(precious, first).error().exit_code == ExitCode::kWrongUse);
  CHECK(std::filesystem::file_size(precious) == 11);
  CHECK_FALSE(bind(folder.path().string(), first));
  CHECK_FALSE(bind(folder.path().string() + std::string(200, 'a'), first));
  CHECK_FALSE(bind("", first));
  const std::string path = (folder.path() / "publish").string();
  REQUIRE(bind(path, first));
  const auto taken = bind(path, second);
  REQUIRE_FALSE(taken);
  CHECK(test::has(taken.error().message, "is in use"));
  // A socket file that a daemon left behind is nobody's.
  const std::string left = (folder.path() / "left").string();
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  left.copy(address.sun_path, sizeof address.sun_path - 1);
  REQUIRE(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  ::close(fd);
  CHECK(bind(left, second));
}

TEST_CASE("localhost is an address to listen on") {
  const Context context = open_context().value();
  const Socket socket = open_socket(context.get(), ZMQ_PUB).value();
  const auto bound = bind_socket(socket.get(), "tcp://localhost:*");
  REQUIRE(bound);
  CHECK(test::has(*bound, "tcp://127.0.0.1:"));
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
