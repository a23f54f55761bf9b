// UDP over real loopback sockets: who may send, when a datagram arrived, several sockets behind one
// descriptor, multicast, and damaged datagrams.
#include <catch2/catch.hpp>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/chunk_text.hpp"

namespace posed::drivers {
namespace {

using test::text_of;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

// Another program's socket.
class Peer {
 public:
  explicit Peer(const std::string& own) {
    const Address address = parse_endpoint(own).value();
    fd_ = ::socket(address.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    REQUIRE(fd_ >= 0);
    REQUIRE(::bind(fd_, address.get(), address.size) == 0);
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Returns whether the system took it.
  bool send(const std::string& to, const std::string& text) const {
    const Address address = parse_endpoint(to).value();
    return ::sendto(fd_, text.data(), text.size(), 0, address.get(), address.size) ==
           static_cast<ssize_t>(text.size());
  }
  [[nodiscard]] std::string receive() const {
    pollfd ready{.fd = fd_, .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, 1000) <= 0) return "nothing";
    std::string text(100, ' ');
    const ssize_t got = ::recv(fd_, text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return text;
  }
  [[nodiscard]] std::string endpoint() const {
    Address address;
    ::getsockname(fd_, address.get(), &address.size);
    return endpoint_text(address);
  }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

bool is_ready(const Transport& transport, int patience_ms = 1000) {
  pollfd ready{.fd = transport.poll_fd(), .events = POLLIN, .revents = 0};
  return ::poll(&ready, 1, patience_ms) > 0;
}

// The next datagram, waiting for it as the reader does.
std::string next(Transport& transport) {
  const std::int64_t due_ns = transport.next_due_ns();
  const bool waits = due_ns == kNoTime_ns || due_ns > now_ns();
  if (waits && !is_ready(transport)) return "nothing";
  return text_of(transport.read(now_ns()).bytes);
}

std::unique_ptr<UdpTransport> open_udp(const UdpSettings& settings) {
  auto opened = UdpTransport::open(settings);
  if (!opened) FAIL(opened.error().text());
  return std::move(*opened);
}

std::unique_ptr<UdpTransport> listen_on(const std::string& endpoint) {
  return open_udp({.sockets = {{.listen = endpoint}}});
}

void check_refused(const UdpSettings& settings, const std::string& word) {
  const auto opened = UdpTransport::open(settings);
  REQUIRE_FALSE(opened);
  INFO(opened.error().message);
  CHECK(opened.error().message.find(word) != std::string::npos);
  CHECK(opened.error().message.find('\n') == std::string::npos);
}

}  // namespace

TEST_CASE("a source names the port that the kernel chose") {
  TransportFactory ports;
  for (const char* driver : {"vmc", "mvn", "mocopi", "rokoko"}) {
    INFO(driver);
    const auto device = find_driver(driver)->open({{"listen", std::string("127.0.0.1:0")}}, ports);
    REQUIRE(device);
    const auto& udp = dynamic_cast<const UdpTransport&>(*device->transport);
    CHECK(device->description.identity == "udp " + udp.endpoint(0));
    CHECK_FALSE(device->description.identity.ends_with(":0"));
  }
  // A device is not named after the socket that asks it.
  const auto natnet = find_driver("natnet")->open(
      {{"server", std::string("127.0.0.1:0")}, {"listen", std::string("0.0.0.0:0")}}, ports);
  REQUIRE(natnet);
  CHECK(natnet->description.identity == "udp 127.0.0.1:0");
}

TEST_CASE("datagrams come one by one, over IPv4 and IPv6") {
  for (const char* own : {"127.0.0.1:0", "[::1]:0"}) {
    INFO(own);
    const auto transport = listen_on(own);
    const Peer peer(own);
    for (int i = 0; i < 40; ++i) REQUIRE(peer.send(transport->endpoint(0), std::to_string(i)));
    for (int i = 0; i < 40; ++i) CHECK(next(*transport) == std::to_string(i));
    CHECK(transport->read(now_ns()).bytes.empty());
    CHECK(transport->next_due_ns() == kNoTime_ns);
    CHECK_FALSE(is_ready(*transport, 0));
  }
}

TEST_CASE("datagrams that wait inside the transport are due at once") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer peer("127.0.0.1:0");
  for (int i = 0; i < 3; ++i) REQUIRE(peer.send(transport->endpoint(0), "x"));
  REQUIRE(is_ready(*transport));
  const std::int64_t at_ns = now_ns();
  CHECK(text_of(transport->read(at_ns).bytes) == "x");
  CHECK_FALSE(is_ready(*transport, 0));  // the kernel has none left
  CHECK(transport->next_due_ns() == at_ns);
  CHECK(text_of(transport->read(at_ns).bytes) == "x");
  CHECK(text_of(transport->read(at_ns).bytes) == "x");
  CHECK(transport->next_due_ns() == kNoTime_ns);
}

// The age that a datagram has for the transport after it waited so long.
std::int64_t age_after(UdpTransport& transport, const Peer& peer, int wait_ms) {
  REQUIRE(peer.send(transport.endpoint(0), "x"));
  std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
  const std::int64_t read_ns = now_ns();
  const Chunk chunk = transport.read(read_ns);
  REQUIRE(chunk.bytes.size() == 1);
  return read_ns - chunk.arrival_ns;
}

// The kernel begins to stamp a little after the first socket of the machine asks for it.
void await_stamps(UdpTransport& transport, const Peer& peer) {
  for (int i = 0; i < 100 && age_after(transport, peer, 20) < 19'000'000; ++i) continue;
}

TEST_CASE("a datagram's time is when the kernel received it") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer peer("127.0.0.1:0");
  await_stamps(*transport, peer);
  for (const auto& [wait_ms, least_ns, most_ns] :
       {std::array{20, 19'000'000, 900'000'000}, std::array{80, 79'000'000, 900'000'000}}) {
    const std::int64_t age_ns = age_after(*transport, peer, wait_ms);
    CHECK(age_ns >= least_ns);
    CHECK(age_ns <= most_ns);
  }
}

TEST_CASE("datagrams that waited for more than a second are dropped and counted") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer peer("127.0.0.1:0");
  await_stamps(*transport, peer);
  for (int i = 0; i < 20; ++i) REQUIRE(peer.send(transport->endpoint(0), "old"));
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));  // as if posed were stopped
  REQUIRE(peer.send(transport->endpoint(0), "new"));
  std::uint32_t dropped = 0;
  std::string text;
  while (text.empty() && is_ready(*transport)) {
    const Chunk chunk = transport->read(now_ns());
    dropped += chunk.kernel_dropped;
    text = text_of(chunk.bytes);
  }
  CHECK(text == "new");
  CHECK(dropped == 20);
}

TEST_CASE("senders that are not among the peers are dropped and counted") {
  const auto transport =
      open_udp({.sockets = {{.listen = "127.0.0.1:0"}}, .peers = {"127.0.0.2", "::1"}});
  const Peer friendly("127.0.0.2:0");
  const Peer stranger("127.0.0.3:0");
  REQUIRE(stranger.send(transport->endpoint(0), "a"));
  REQUIRE(stranger.send(transport->endpoint(0), "b"));
  REQUIRE(friendly.send(transport->endpoint(0), "c"));
  REQUIRE(is_ready(*transport));
  Chunk chunk = transport->read(now_ns());
  CHECK(text_of(chunk.bytes) == "c");
  CHECK(chunk.foreign == 2);
  REQUIRE(stranger.send(transport->endpoint(0), "d"));
  REQUIRE(is_ready(*transport));
  chunk = transport->read(now_ns());
  CHECK(chunk.bytes.empty());
  CHECK(chunk.foreign == 1);
  const std::string answer = "e";
  REQUIRE(transport->send(std::as_bytes(std::span(answer))));
  CHECK(friendly.receive() == "e");  // not to the stranger, who spoke last
}

TEST_CASE("of two programs on one computer the first is heard, and the log says so once") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer first("127.0.0.1:0");
  const Peer second("127.0.0.1:0");
  std::int64_t time_ns = 10 * kNanosPerSecond;
  const auto arrives = [&](const Peer& from) {
    REQUIRE(from.send(transport->endpoint(0), "x"));
    REQUIRE(is_ready(*transport));
    return !transport->read(time_ns).bytes.empty();
  };
  CHECK(arrives(first));
  CHECK(arrives(first));
  CHECK(transport->consume_note().empty());
  for (int i = 0; i < 5; ++i) {
    CHECK_FALSE(arrives(second));
    CHECK(arrives(first));
  }
  CHECK(transport->consume_note().starts_with("two programs"));
  CHECK_FALSE(arrives(second));
  CHECK(transport->consume_note().empty());
  time_ns += kNanosPerSecond;
  CHECK(arrives(second));
  // Also if they took turns from the start, one of them alone stays.
  time_ns += 2 * kNanosPerSecond;
  CHECK(arrives(first));
  CHECK(arrives(second));
  for (int i = 0; i < 5; ++i) {
    CHECK_FALSE(arrives(first));
    CHECK(arrives(second));
  }
}

TEST_CASE("a program that has a new port for each datagram is heard") {
  const auto transport = listen_on("127.0.0.1:0");
  for (int i = 0; i < 20; ++i) {
    const Peer peer("127.0.0.1:0");
    REQUIRE(peer.send(transport->endpoint(0), std::to_string(i)));
    CHECK(next(*transport) == std::to_string(i));
  }
}

TEST_CASE("a socket has one sender at a time; after a second of silence another one may send") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer first("127.0.0.2:0");
  const Peer second("127.0.0.3:0");
  std::int64_t time_ns = 10 * kNanosPerSecond;
  const auto arrives = [&](const Peer& from) {
    REQUIRE(from.send(transport->endpoint(0), "x"));
    REQUIRE(is_ready(*transport));
    const Chunk chunk = transport->read(time_ns);
    CHECK(chunk.foreign == (chunk.bytes.empty() ? 1 : 0));
    return !chunk.bytes.empty();
  };
  CHECK(arrives(first));
  CHECK_FALSE(arrives(second));
  time_ns += kNanosPerSecond * 9 / 10;
  CHECK_FALSE(arrives(second));  // to be refused keeps nothing
  CHECK(arrives(first));
  time_ns += kNanosPerSecond * 9 / 10;
  CHECK_FALSE(arrives(second));
  CHECK(arrives(first));
  time_ns += kNanosPerSecond;
  CHECK(arrives(second));
  CHECK_FALSE(arrives(first));
}

TEST_CASE("empty and too long datagrams are dropped and counted") {
  const auto transport = listen_on("[::1]:0");
  const Peer peer("[::1]:0");
  const std::string longest(65'507, 'x');
  REQUIRE(peer.send(transport->endpoint(0), ""));
  const bool sent = peer.send(transport->endpoint(0), longest + "y");
  REQUIRE(peer.send(transport->endpoint(0), longest));
  REQUIRE(is_ready(*transport));
  const Chunk chunk = transport->read(now_ns());
  CHECK(text_of(chunk.bytes) == longest);
  CHECK(chunk.damaged == (sent ? 2 : 1));
}

TEST_CASE("who sends nothing that is read takes no socket from others") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer empty("127.0.0.1:0");
  const Peer device("127.0.0.2:0");
  REQUIRE(empty.send(transport->endpoint(0), ""));
  REQUIRE(is_ready(*transport));
  CHECK(transport->read(now_ns()).damaged == 1);
  REQUIRE(device.send(transport->endpoint(0), "a"));
  CHECK(next(*transport) == "a");
}

TEST_CASE("what the kernel drops because nobody reads is counted with the next datagram") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer peer("127.0.0.1:0");
  // More than the largest buffer that the transport asks for.
  const std::string large(60'000, 'x');
  std::uint32_t sent = 0, received = 0, dropped = 0;
  const auto read_all = [&] {
    while (transport->next_due_ns() != kNoTime_ns || is_ready(*transport, 100)) {
      const Chunk chunk = transport->read(now_ns());
      if (!chunk.bytes.empty()) ++received;
      dropped += chunk.kernel_dropped;
    }
  };
  for (int flood = 0; flood < 2; ++flood) {
    for (int i = 0; i < 100; ++i) sent += peer.send(transport->endpoint(0), large) ? 1 : 0;
    read_all();
    CHECK(received < sent);
    REQUIRE(peer.send(transport->endpoint(0), "the next"));
    ++sent;
    read_all();
    CHECK(dropped > 0);
    CHECK(received + dropped == sent);
  }
}

TEST_CASE("several sockets have one descriptor, and every datagram says where it came from") {
  const auto transport =
      open_udp({.sockets = {{.listen = "127.0.0.1:0"}, {.listen = "127.0.0.1:0"}}});
  const Peer peer("127.0.0.1:0");
  const Peer other("127.0.0.1:0");
  REQUIRE(other.send(transport->endpoint(1), "second"));
  REQUIRE(is_ready(*transport));
  Chunk chunk = transport->read(now_ns());
  CHECK(chunk.socket == 1);
  CHECK(text_of(chunk.bytes) == "second");
  REQUIRE(peer.send(transport->endpoint(0), "first"));
  REQUIRE(is_ready(*transport));
  chunk = transport->read(now_ns());
  CHECK(chunk.socket == 0);
  CHECK(text_of(chunk.bytes) == "first");
  const std::string answer = "answer";
  const auto bytes = std::as_bytes(std::span(answer));
  CHECK(transport->send(bytes, 1));
  CHECK(other.receive() == "answer");
  CHECK_FALSE(transport->send(bytes, 2));
  // Neither socket can keep the other from being read.
  for (int i = 0; i < 40; ++i) REQUIRE(peer.send(transport->endpoint(0), "a"));
  REQUIRE(other.send(transport->endpoint(1), "b"));
  int before_b = 0;
  while (next(*transport) == "a") ++before_b;
  CHECK(before_b <= 16);
}

TEST_CASE("a configured receiver is sent to before anything came; without one nothing is sent") {
  const Peer device("127.0.0.1:0");
  const auto transport =
      open_udp({.sockets = {{.listen = "127.0.0.1:0", .to = device.endpoint()}}});
  const std::string request = "hello";
  const auto bytes = std::as_bytes(std::span(request));
  REQUIRE(transport->send(bytes));
  CHECK(device.receive() == "hello");
  const Peer other("127.0.0.1:0");
  REQUIRE(other.send(transport->endpoint(0), "x"));
  CHECK(next(*transport) == "x");
  REQUIRE(transport->send(bytes));
  CHECK(device.receive() == "hello");
  CHECK_FALSE(listen_on("127.0.0.1:0")->send(bytes));
}

TEST_CASE("a receiver that has gone does not stop the stream") {
  const auto transport = listen_on("127.0.0.1:0");
  {
    const Peer gone("127.0.0.1:0");
    REQUIRE(gone.send(transport->endpoint(0), "x"));
    CHECK(next(*transport) == "x");
  }
  const std::string request = "hello";
  (void)transport->send(std::as_bytes(std::span(request)));  // the kernel learns that it has gone
  const Peer peer("127.0.0.1:0");
  REQUIRE(peer.send(transport->endpoint(0), "y"));
  std::string got;
  for (int i = 0; i < 3 && got.empty(); ++i) got = next(*transport);
  CHECK(got == "y");
}

TEST_CASE("a multicast group is received on the chosen interface") {
  for (const char* interface : {"lo", "127.0.0.1"}) {
    INFO(interface);
    auto opened =
        UdpTransport::open({.sockets = {{.listen = "0.0.0.0:0", .group = "239.255.42.99"}},
                            .interface = interface,
                            .peers = {"127.0.0.1"}});
    if (!opened) {
      WARN("SKIPPED: no multicast on loopback here: " + opened.error().text());
      return;
    }
    const Peer peer("127.0.0.1:0");
    const in_addr loopback{.s_addr = htonl(INADDR_LOOPBACK)};
    REQUIRE(::setsockopt(peer.fd(), IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback) == 0);
    const std::string endpoint = (*opened)->endpoint(0);
    const std::string port = endpoint.substr(endpoint.rfind(':'));
    if (!peer.send("239.255.42.99" + port, "to all")) {
      WARN("SKIPPED: this machine does not send multicast on loopback");
      return;
    }
    CHECK(next(**opened) == "to all");
    REQUIRE(peer.send("239.255.42.98" + port, "another group"));
    CHECK(next(**opened) == "nothing");
    // Joining it again in a silence is no work of the reader; who does it disturbs nothing.
    CHECK((*opened)->next_due_ns() == kNoTime_ns);
    const std::int64_t received_ns = now_ns();
    for (int i = 1; i < 10; ++i) (*opened)->upkeep(received_ns + i * kNanosPerSecond);
    REQUIRE(peer.send("239.255.42.99" + port, "to all again"));
    CHECK(next(**opened) == "to all again");
  }
}

TEST_CASE("the group and the port that a device names are used instead") {
  const UdpSettings settings{
      .sockets = {{.listen = "127.0.0.1:0"}, {.listen = "0.0.0.0:0", .group = "239.255.42.99"}},
      .data_place = [](std::span<const std::byte> bytes) noexcept -> std::optional<DataPlace> {
        if (bytes.size() != 3) return std::nullopt;
        const auto number = [&](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
        return DataPlace{.group = 0xEFFF2A00U | number(0), .port = number(1) << 8U | number(2)};
      },
      .interface = "lo",
      .peers = {"127.0.0.1"}};
  const auto opened = UdpTransport::open(settings);
  if (!opened) {
    WARN("SKIPPED: no multicast on loopback here: " + opened.error().text());
    return;
  }
  UdpTransport& transport = **opened;
  const Peer peer("127.0.0.1:0");
  const in_addr loopback{.s_addr = htonl(INADDR_LOOPBACK)};
  REQUIRE(::setsockopt(peer.fd(), IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback) == 0);
  const auto port_at = [](const std::string& endpoint) {
    return std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  };
  const auto announce = [&](char group, int port) {
    REQUIRE(peer.send(transport.endpoint(0),
                      {group, static_cast<char>(port >> 8), static_cast<char>(port & 0xFF)}));
    CHECK(next(transport).size() == 3);
    transport.upkeep(0);
  };
  const int first_port = port_at(transport.endpoint(1));
  const auto to = [](int group, int port) {
    return "239.255.42." + std::to_string(group) + ':' + std::to_string(port);
  };
  REQUIRE(peer.send(transport.endpoint(0), "what is this?"));
  CHECK(next(transport) == "what is this?");
  transport.upkeep(0);
  CHECK(transport.consume_note().empty());
  announce('b', first_port);
  CHECK(transport.consume_note().find("group 239.255.42.98, port ") != std::string::npos);
  CHECK(transport.consume_note().empty());
  if (!peer.send(to(98, first_port), "to all")) {
    WARN("SKIPPED: this machine does not send multicast on loopback");
    return;
  }
  CHECK(next(transport) == "to all");
  REQUIRE(peer.send(to(99, first_port), "the group of before"));
  CHECK(next(transport) == "nothing");
  auto taken = std::make_unique<Peer>("0.0.0.0:0");
  const int port = port_at(taken->endpoint());
  announce('c', port);
  CHECK(transport.consume_note().find("cannot listen on 0.0.0.0:") != std::string::npos);
  REQUIRE(peer.send(to(98, first_port), "where it was"));
  CHECK(next(transport) == "where it was");
  taken.reset();
  announce('b', port);
  CHECK(transport.consume_note().find("which is joined now") != std::string::npos);
  REQUIRE(peer.send(to(98, first_port), "the port of before"));
  CHECK(next(transport) == "nothing");
  REQUIRE(peer.send(to(98, port), "at the other port"));
  CHECK(next(transport) == "at the other port");
}

TEST_CASE("settings that open posed to the network or make no sense are refused") {
  check_refused({}, "name an address to listen on");
  check_refused({.sockets = {{.listen = "0.0.0.0:0"}}}, "name the senders' addresses in peers");
  check_refused({.sockets = {{.listen = "[::]:0"}}}, "name the senders' addresses in peers");
  check_refused({.sockets = {{.listen = "localhost:0"}}}, "an address and a port");
  check_refused({.sockets = {{.listen = "127.0.0.1"}}}, "an address and a port");
  check_refused({.sockets = {{.listen = "127.0.0.1:0", .to = "studio"}}}, "an address and a port");
  check_refused({.sockets = {{.listen = "127.0.0.1:0"}}, .peers = {"studio"}}, "in numbers");
  check_refused({.sockets = {{.listen = "127.0.0.1:0"}}, .peers = {""}}, "in numbers");
  check_refused({.sockets = {{.listen = "0.0.0.0:0", .group = "10.0.0.1"}}, .peers = {"10.0.0.1"}},
                "a multicast address");
  check_refused({.sockets = {{.listen = "127.0.0.1:0", .group = "239.1.1.1"}}},
                "listen on 0.0.0.0:PORT");
  check_refused({.sockets = {{.listen = "0.0.0.0:0", .group = "ff02::1"}}, .peers = {"10.0.0.1"}},
                "listen on [::]:PORT");
  check_refused({.sockets = {{.listen = "0.0.0.0:0", .group = "239.1.1.1"}},
                 .interface = "no-such-interface",
                 .peers = {"10.0.0.1"}},
                "no network interface 'no-such-interface'");
  const auto first = listen_on("127.0.0.1:0");
  check_refused({.sockets = {{.listen = first->endpoint(0)}}}, "a port that is free");
}

TEST_CASE("a factory that only prepares opens no socket, and still refuses wrong settings") {
  TransportFactory ports;
  ports.only_prepare(true);
  CHECK(ports.udp({.sockets = {{.listen = "0.0.0.0:0"}}}).error().exit_code == ExitCode::kWrongUse);
  CHECK(ports.udp({.sockets = {{.listen = "127.0.0.1:0"}}}).error().exit_code == ExitCode::kFailed);
  ports.only_prepare(false);
  CHECK(ports.udp({.sockets = {{.listen = "127.0.0.1:0"}}}));
}

TEST_CASE("reading and sending datagrams does not allocate") {
  const auto transport = listen_on("127.0.0.1:0");
  const Peer peer("127.0.0.1:0");
  for (int i = 0; i < 50; ++i) REQUIRE(peer.send(transport->endpoint(0), "abc"));
  REQUIRE(is_ready(*transport));
  const std::array<std::byte, 3> answer{};
  std::size_t got = 0;
  const std::uint64_t before = test::allocations();
  for (int i = 0; i < 60; ++i) got += transport->read(1).bytes.size();
  const bool sent = transport->send(answer);
  CHECK(test::allocations() == before);
  CHECK(got == 150);
  CHECK(sent);
}

}  // namespace posed::drivers
