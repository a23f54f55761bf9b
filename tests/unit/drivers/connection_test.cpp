// Connections over pseudo-terminals and loopback sockets: bytes are unchanged, hang-ups are
// reported, mistakes are named.
#include <arpa/inet.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <numeric>
#include <optional>
#include <thread>

#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/upkeep.hpp"
#include "tests/support/free_port.hpp"
#include "tests/unit/drivers/chunk_text.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers {
namespace {

using std::chrono::milliseconds;
using test::free_port;
using test::PseudoTerminal;
using test::text_of;

constexpr milliseconds kPatience{2000};

Connection open_port(const PseudoTerminal& terminal, int baud = 115200) {
  TransportFactory ports;
  auto link = ports.serial({.port = terminal.port(), .baud = baud});
  REQUIRE(link);
  return std::move(*link);
}

std::string all_bytes() {
  std::string bytes(256, '\0');
  std::iota(bytes.begin(), bytes.end(), '\0');
  return bytes;
}

bool readable(const Transport& transport) {
  pollfd wanted{.fd = transport.poll_fd(), .events = POLLIN, .revents = 0};
  return ::poll(&wanted, 1, static_cast<int>(kPatience.count())) == 1;
}

// A client on loopback; the destructor closes it.
class Client {
 public:
  // `host`: of the client, 127.0.0.`host`.
  explicit Client(std::uint16_t port, std::uint32_t host = 1)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl((127U << 24U) | host);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  }
  ~Client() { ::close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void say(std::string_view text) const {
    REQUIRE(::write(fd_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }

 private:
  int fd_;
};

std::string loopback(std::uint16_t port) { return "127.0.0.1:" + std::to_string(port); }

// The connection of a client that has just come.
auto accepted(TransportFactory& ports, std::uint16_t port) {
  auto link = ports.accept({.endpoint = loopback(port)});
  REQUIRE(link);
  return make_link_transport(std::move(*link));
}

}  // namespace

TEST_CASE("every byte value crosses a port unchanged, both ways") {
  const PseudoTerminal terminal;
  Connection link = open_port(terminal);
  REQUIRE(link.write(all_bytes()));
  CHECK(terminal.received() == all_bytes());
  terminal.say(all_bytes());
  const auto bytes = link.read(kPatience);
  REQUIRE(bytes);
  CHECK(text_of(*bytes) == all_bytes());
}

TEST_CASE("a port takes the baud rates of gloves") {
  for (const int baud : {9600, 19200, 38400, 57600, 115200, 230400, 460800, 1'000'000}) {
    const PseudoTerminal terminal;
    Connection link = open_port(terminal, baud);
    REQUIRE(link.write("x"));
    CHECK(terminal.received() == "x");
  }
  TransportFactory ports;
  CHECK_FALSE(ports.serial({.port = "/dev/null", .baud = 0}));
}

TEST_CASE("bytes from before the port was opened are discarded") {
  const PseudoTerminal terminal;
  {
    Connection first = open_port(terminal);
  }
  terminal.say("stale\n");
  Connection link = open_port(terminal);
  const auto bytes = link.read(milliseconds{0});
  REQUIRE(bytes);
  CHECK(bytes->empty());
}

TEST_CASE("drain discards everything received before") {
  const PseudoTerminal terminal;
  Connection link = open_port(terminal);
  terminal.say("noise");
  REQUIRE(link.drain(milliseconds{1}));
  terminal.say("answer");
  const auto bytes = link.read(kPatience);
  REQUIRE(bytes);
  CHECK(text_of(*bytes) == "answer");
}

TEST_CASE("a device that was opened early begins with what comes from its start on") {
  PseudoTerminal terminal;
  const auto transport = make_link_transport(open_port(terminal));
  terminal.say("old");
  REQUIRE(readable(*transport));
  REQUIRE(transport->start(0));
  terminal.say("new");
  REQUIRE(readable(*transport));
  CHECK(text_of(transport->read(0).bytes) == "new");
}

TEST_CASE("an unplugged port is reported as lost to the reader and as an error to cold code") {
  PseudoTerminal terminal;
  const auto transport = make_link_transport(open_port(terminal));
  REQUIRE(transport->start(0));
  CHECK(transport->read(0).bytes.empty());
  terminal.say("last words");
  REQUIRE(readable(*transport));
  CHECK(text_of(transport->read(0).bytes) == "last words");
  terminal.unplug();
  REQUIRE(readable(*transport));
  CHECK(transport->read(0).lost);
  CHECK_FALSE(transport->send(std::array{std::byte{1}}));

  PseudoTerminal second;
  Connection link = open_port(second);
  second.unplug();
  const auto bytes = link.read(kPatience);
  REQUIRE_FALSE(bytes);
  CHECK(bytes.error().message.find("has gone") != std::string::npos);
}

TEST_CASE("a message that a full port took in part is completed before anything else is sent") {
  const PseudoTerminal terminal;
  const auto transport = make_link_transport(open_port(terminal));
  const std::vector<std::byte> letters(3000, std::byte{'a'});
  const std::array digit{std::byte{'1'}};
  std::string taken;
  while (transport->send(letters)) taken.append(letters.size(), 'a');
  if (transport->send(digit)) taken += '1';  // the kernel may have freed space meanwhile
  std::string received;
  while (received.size() < taken.size()) {
    received += terminal.received();
    CHECK(transport->read(0).bytes.empty());  // read() also sends the rest
  }
  CHECK(received == taken);
  REQUIRE(transport->send(digit));
  CHECK(terminal.received() == "1");
}

TEST_CASE("a message longer than the buffer is refused whole") {
  const PseudoTerminal terminal;
  const auto transport = make_link_transport(open_port(terminal));
  CHECK_FALSE(transport->send(std::vector<std::byte>(kMaxChunk)));
}

TEST_CASE("a second posed reports which process has the port") {
  const PseudoTerminal terminal;
  const Connection link = open_port(terminal);
  TransportFactory ports;
  const auto second = ports.serial({.port = terminal.port()});
  REQUIRE_FALSE(second);
  CHECK(second.error().message.starts_with(terminal.port() + " is in use by "));
}

TEST_CASE("a port that is missing or not a serial port is refused with an error message") {
  TransportFactory ports;
  const auto missing = ports.serial({.port = "/dev/ttyNotThere"});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().message.find("is not there") != std::string::npos);
  const auto foreign = ports.serial({.port = "/dev/null"});
  REQUIRE_FALSE(foreign);
  CHECK(foreign.error().message.find("no serial port") != std::string::npos);
}

TEST_CASE("a glove that connects between two tries is kept, and the newest counts") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client older(port), newer(port);
  older.say("older");
  newer.say("newer");
  auto link = ports.accept({.endpoint = loopback(port)});
  REQUIRE(link);
  CHECK(link->identity() == "tcp 127.0.0.1");
  const auto bytes = link->read(kPatience);
  REQUIRE(bytes);
  CHECK(text_of(*bytes) == "newer");
}

TEST_CASE("a glove that hangs up is lost, and may come again") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  for (int round = 0; round < 3; ++round) {
    auto glove = std::make_unique<Client>(port);
    const auto transport = accepted(ports, port);
    glove->say("frame");
    glove.reset();
    REQUIRE(readable(*transport));
    CHECK(text_of(transport->read(0).bytes) == "frame");
    REQUIRE(readable(*transport));
    CHECK(transport->read(0).lost);
  }
}

TEST_CASE("without a free descriptor the glove is reported as present, and waits for one") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client glove(port);
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
  const int lowest = ::dup(0);  // the next free descriptor number
  REQUIRE(lowest >= 0);
  ::close(lowest);
  const rlimit none{static_cast<rlim_t>(lowest), before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
  const auto refused = ports.accept({.endpoint = loopback(port)});
  REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message.find("LimitNOFILE") != std::string::npos);
  CHECK(ports.accept({.endpoint = loopback(port)}));
}

TEST_CASE("only peers may connect, and without peers only loopback listens") {
  TransportFactory ports;
  const auto open_door = ports.accept({.endpoint = "0.0.0.0:5200"});
  REQUIRE_FALSE(open_door);
  CHECK(open_door.error().message.find("peers") != std::string::npos);

  const std::uint16_t port = free_port();
  const ListenSettings others{.endpoint = loopback(port), .peers = {"192.0.2.7"}};
  CHECK_FALSE(ports.accept(others));
  const Client unknown(port);
  CHECK_FALSE(ports.accept(others));
  CHECK(ports.refused() == 1);
  CHECK_FALSE(check_listen({.endpoint = loopback(port), .peers = {"glove.local"}}));
  CHECK(check_listen({.endpoint = loopback(port), .peers = {"::ffff:192.0.2.7"}}));
}

TEST_CASE("a connection that begins as a web browser's is ended and counted, byte by byte, too") {
  const std::string body(3000, 'A');
  const std::vector<std::string> browsers{
      "POST / HTTP/1.1\r\n\r\n" + body,    "GET / HTTP/1.1\r\n\r\n",
      "OPTIONS * HTTP/1.1\r\n\r\n" + body, "PUT / HTTP/1.1\r\n\r\n" + body,
      "HEAD / HTTP/1.1\r\n\r\n",           "CONNECT a:1 HTTP/1.1\r\n\r\n",
      "PRI * HTTP/2.0\r\n\r\n" + body,     "\x16\x03\x01" + body};
  for (const std::string& request : browsers) {
    for (const std::size_t piece : {std::size_t{1}, std::size_t{4}, request.size()}) {
      INFO(request.substr(0, 8) << " in pieces of " << piece);
      const std::uint16_t port = free_port();
      TransportFactory ports;
      CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
      const Client page(port);
      const auto transport = accepted(ports, port);
      REQUIRE(transport->start(0));
      Chunk chunk;
      for (std::size_t at = 0; at < std::min<std::size_t>(request.size(), 12) && !chunk.lost;) {
        page.say(request.substr(at, piece));
        at += piece;
        REQUIRE(readable(*transport));
        chunk = transport->read(0);
        CHECK(chunk.bytes.empty());
      }
      CHECK(chunk.lost);
      CHECK(chunk.foreign == 1);
      CHECK(transport->read(0).bytes.empty());
    }
  }
}

TEST_CASE("a request is a browser's whatever its method, and what follows its line is not read") {
  const std::string lines = "A1B2C3D4E5\nA1B2C3D4E5\n";
  for (const std::string& request :
       std::vector<std::string>{"A100B200 / HTTP/1.1\r\nHost: glove.example:1\r\n\r\n" + lines,
                                "\r\npatch / HTTP/1.1\r\n\r\n" + lines,
                                std::string(3000, 'A') + " / HTTP/1.1\r\n\r\n" + lines}) {
    for (const std::size_t piece : {std::size_t{1}, std::size_t{700}, request.size()}) {
      INFO(request.substr(0, 8) << " in pieces of " << piece);
      const std::uint16_t port = free_port();
      TransportFactory ports;
      CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
      const Client page(port);
      const auto transport = accepted(ports, port);
      REQUIRE(transport->start(0));
      std::string read;
      Chunk chunk;
      for (std::size_t at = 0; at < request.size() && !chunk.lost; at += piece) {
        page.say(request.substr(at, piece));
        REQUIRE(readable(*transport));
        chunk = transport->read(0);
        read += text_of(chunk.bytes);
      }
      CHECK(chunk.lost);
      CHECK(chunk.foreign == 1);
      CHECK_FALSE(read.contains("A1B2"));
    }
  }
}

TEST_CASE("a connection that brings megabytes of nothing of use is ended and counted") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client stranger(port);
  const auto transport = accepted(ports, port);
  REQUIRE(transport->start(0));
  Chunk chunk;
  std::size_t read = 0;
  for (int i = 0; i < 6000 && !chunk.lost; ++i) {
    stranger.say(std::string(1000, '!'));
    REQUIRE(readable(*transport));
    chunk = transport->read(0);
    read += chunk.bytes.size();
    transport->decoded(i == 1000);
  }
  CHECK(chunk.lost);
  CHECK(chunk.foreign == 1);
  CHECK(read > 4'000'000);  // what was of use begins the count anew
  CHECK(read < 4'200'000);

  const Client slow(port);  // a paused device, for example, which repeats itself
  const auto other = accepted(ports, port);
  REQUIRE(other->start(0));
  for (int i = 0; i < 2000; ++i) {
    slow.say(std::string(1000, '!'));
    REQUIRE(readable(*other));
    REQUIRE_FALSE(other->read(i * kNanosPerSecond / 500).lost);
    other->decoded(false);
  }
}

TEST_CASE("who floods must wait before coming again, and another host need not") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  {
    const Client stranger(port);
    const auto transport = accepted(ports, port);
    REQUIRE(transport->start(1));
    Chunk chunk;
    while (!chunk.lost) {
      stranger.say(std::string(4000, '!'));
      REQUIRE(readable(*transport));
      chunk = transport->read(1);
      if (!chunk.lost) CHECK(chunk.sender != 0);
      transport->decoded(false);
    }
    auto& upkeep = dynamic_cast<Upkeep&>(*transport);
    CHECK(upkeep.consume_note().contains("too much of nothing usable"));
    CHECK(upkeep.consume_note().empty());
  }
  // Of its host the first one that comes then waits, also where others come after it.
  const Client device(port);
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client other(port, 2), behind(port);
  auto link = ports.accept({.endpoint = loopback(port)});
  REQUIRE(link);
  CHECK(link->identity() == "tcp 127.0.0.2");
  CHECK(ports.refused() == 0);
  std::this_thread::sleep_for(PausedHosts::kPause);
  const auto first = accepted(ports, port);
  REQUIRE(first->start(1));
  device.say("here");
  REQUIRE(readable(*first));
  CHECK(text_of(first->read(1).bytes) == "here");
}

TEST_CASE("who posed connects to is cut, too, once it floods, and tried again after a pause") {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  REQUIRE(::listen(listener, 4) == 0);  // on a free port
  sockaddr_in address{};
  socklen_t size = sizeof address;
  REQUIRE(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  const std::string there = loopback(ntohs(address.sin_port));
  TransportFactory ports;
  {
    const auto transport = make_link_transport(ports.connect(there).value());
    const int server = ::accept(listener, nullptr, nullptr);
    REQUIRE(transport->start(1));
    const std::string junk(4000, '!');
    Chunk chunk;
    std::size_t read = 0;
    while (!chunk.lost && read < 9'000'000) {
      REQUIRE(::write(server, junk.data(), junk.size()) > 0);
      REQUIRE(readable(*transport));
      chunk = transport->read(1);
      read += chunk.bytes.size();
      if (!chunk.lost) REQUIRE(chunk.is_part_of_link());
      transport->decoded(false);
    }
    CHECK(read > 3'000'000);
    CHECK(read < 3'300'000);
    CHECK(dynamic_cast<Upkeep&>(*transport).consume_note().contains("nothing usable"));
    ::close(server);
  }
  const auto began = std::chrono::steady_clock::now();
  CHECK(ports.connect(there));
  CHECK(std::chrono::steady_clock::now() - began >= PausedHosts::kPause);
  ::close(listener);
}

TEST_CASE("a page whose request has come already takes no device's place, nor is it read") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client glove(port), page(port);
  glove.say("glove");
  page.say("POST / HTTP/1.1\r\n\r\n");
  auto link = ports.accept({.endpoint = loopback(port)});
  REQUIRE(link);
  const auto bytes = link->read(kPatience);
  REQUIRE(bytes);
  CHECK(text_of(*bytes) == "glove");
  CHECK(ports.refused() == 1);
}

TEST_CASE("bytes that begin like a browser's and go on otherwise are a device's, all of them") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  const Client glove(port);
  const auto transport = accepted(ports, port);
  glove.say("PO");
  REQUIRE(readable(*transport));
  CHECK(transport->read(0).bytes.empty());
  glove.say("S1\nGET / ");
  REQUIRE(readable(*transport));
  CHECK(text_of(transport->read(0).bytes) == "POS1\nGET / ");
  glove.say("POST / ");
  REQUIRE(readable(*transport));
  CHECK(text_of(transport->read(0).bytes) == "POST / ");
}

TEST_CASE("cancelling while a device is opened ends all waits, then and later") {
  using std::chrono::hours;
  const PseudoTerminal silent;
  TransportFactory ports;
  auto link = ports.serial({.port = silent.port()});
  REQUIRE(link);
  std::thread stopper([&] { ports.cancel(); });
  const auto bytes = link->read(hours(1));
  stopper.join();
  REQUIRE_FALSE(bytes);
  CHECK(bytes.error().message.find("posed stops") != std::string::npos);
  CHECK_FALSE(link->drain(hours(1)));
  CHECK_FALSE(link->write("x"));
  CHECK_FALSE(ports.accept({.endpoint = loopback(free_port())}));
}

TEST_CASE("ports that only prepare listen already, open nothing and still refuse wrong use") {
  const PseudoTerminal terminal;
  const std::uint16_t port = free_port();
  TransportFactory ports;
  ports.only_prepare(true);
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  CHECK_FALSE(ports.serial({.port = terminal.port()}));
  CHECK(ports.serial({.port = terminal.port(), .baud = 0}).error().exit_code ==
        ExitCode::kWrongUse);
  CHECK(ports.accept({.endpoint = "nonsense"}).error().exit_code == ExitCode::kWrongUse);
  const Client early(port);  // is kept until the factory opens devices
  ports.only_prepare(false);
  CHECK(ports.accept({.endpoint = loopback(port)}));
  CHECK(ports.serial({.port = terminal.port()}));
}

TEST_CASE("an endpoint that is invalid or taken is refused with an error message") {
  TransportFactory ports;
  for (const char* wrong : {"", "5200", ":5200", "127.0.0.1:", "glove:5200", "127.0.0.1:x",
                            "127.0.0.1:-1", "127.0.0.1:65536", "127.0.0.1:+5"}) {
    const auto link = ports.accept({.endpoint = wrong});
    REQUIRE_FALSE(link);
    CHECK(link.error().exit_code == ExitCode::kWrongUse);
  }
  const std::uint16_t port = free_port();
  CHECK_FALSE(ports.accept({.endpoint = loopback(port)}));
  TransportFactory baseline;
  const auto taken = baseline.accept({.endpoint = loopback(port)});
  REQUIRE_FALSE(taken);
  CHECK(taken.error().message.find("cannot listen") != std::string::npos);
}

TEST_CASE("who sends nothing of use gives way to the device that waits") {
  const std::uint16_t port = free_port();
  TransportFactory ports;
  const ListenSettings settings{.endpoint = loopback(port), .peers = {}, .device = "glove"};
  CHECK_FALSE(ports.accept(settings));
  const Client silent(port);
  auto link = ports.accept(settings);
  REQUIRE(link);
  const auto transport = make_link_transport(std::move(*link));
  auto* upkeep = dynamic_cast<Upkeep*>(transport.get());
  REQUIRE(upkeep != nullptr);
  REQUIRE(transport->start(0));
  upkeep->upkeep(9 * kNanosPerSecond);
  CHECK(transport->read(9 * kNanosPerSecond).bytes.empty());
  CHECK_FALSE(transport->read(9 * kNanosPerSecond).lost);  // nobody else waits
  const Client device(port);
  SECTION("unless it was of use just now") {
    transport->decoded(true);
    upkeep->upkeep(13 * kNanosPerSecond);
    CHECK_FALSE(transport->read(13 * kNanosPerSecond).lost);
    upkeep->upkeep(14 * kNanosPerSecond);
  }
  SECTION("also when it sends rubbish") {
    transport->decoded(false);
    upkeep->upkeep(10 * kNanosPerSecond);
  }
  CHECK(upkeep->consume_note().find("another device waits") != std::string::npos);
  CHECK(upkeep->consume_note().empty());
  REQUIRE(readable(*transport));
  CHECK(transport->read(15 * kNanosPerSecond).lost);
  CHECK(ports.accept(settings));
}

}  // namespace posed::drivers
