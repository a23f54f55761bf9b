#include "daemon/output/udp_receivers.hpp"

#include <cerrno>

#include <sys/socket.h>
#include <unistd.h>

#include "drivers/transport/socket.hpp"

namespace posed::output {
namespace {

constexpr std::int64_t kRetry_ns = kNanosPerSecond;
constexpr std::int64_t kGood_ns = 2 * kNanosPerSecond;

// Connected sockets, because only those learn that nobody listens at the other side.
Result<int> open_socket(const drivers::Address& address) {
  const int fd = drivers::open_socket(address, SOCK_DGRAM);
  if (fd < 0) return fail("cannot open a UDP socket (" + errno_text() + ")");
  const int yes = 1;  // who writes down a broadcast address wants that
  ::setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
  return fd;
}

std::string why(int error) {
  if (error == ECONNREFUSED) return "nobody listens there; start the receiver, or correct its port";
  if (error == EAGAIN || error == ENOBUFS) return "the network takes no more at this rate";
  if (error == EMSGSIZE) {
    return "so many people do not fit into one datagram; name fewer, or of rokoko lz4 = true";
  }
  return errno_text(error);
}

}  // namespace

Result<UdpReceivers> UdpReceivers::open(const std::vector<std::string>& endpoints) {
  UdpReceivers receivers;
  for (const std::string& endpoint : endpoints) {
    const auto address = TRY(drivers::parse_endpoint(endpoint));
    const auto fd = TRY(open_socket(address));
    Receiver& receiver = receivers.receivers_.emplace_back();
    receiver.endpoint = endpoint;
    receiver.address = address;
    receiver.fd = fd;
    connect(receiver);
  }
  return receivers;
}

UdpReceivers::~UdpReceivers() {
  for (const Receiver& receiver : receivers_) ::close(receiver.fd);
}

void UdpReceivers::connect(Receiver& receiver) noexcept {
  receiver.connected = ::connect(receiver.fd, receiver.address.get(), receiver.address.size) == 0;
  if (!receiver.connected) receiver.error = errno;
}

bool UdpReceivers::is_connected(Receiver& receiver, std::int64_t now_ns) noexcept {
  if (receiver.connected) return true;
  if (receiver.retry_ns != kNoTime_ns && now_ns < receiver.retry_ns) return false;
  receiver.retry_ns = now_ns + kRetry_ns;
  connect(receiver);
  return receiver.connected;
}

bool UdpReceivers::send_to(Receiver& receiver, std::span<const std::byte> datagram,
                           std::int64_t now_ns, SendOutcome& outcome) noexcept {
  if (!is_connected(receiver, now_ns)) {
    ++outcome.failed;
    return false;
  }
  const auto send = [&] {
    return ::send(receiver.fd, datagram.data(), datagram.size(), MSG_NOSIGNAL) >= 0;
  };
  if (send()) {
    ++outcome.sent;
    return true;
  }
  receiver.error = errno;
  if (receiver.error == EAGAIN || receiver.error == ENOBUFS) {
    ++outcome.dropped;
    return false;
  }
  ++outcome.failed;
  if (receiver.error == ECONNREFUSED) {
    // That was the answer to earlier datagrams, one for all of them, which are counted as sent;
    // this one is sent now, and counted as failed for them.
    static_cast<void>(send());
  } else {
    receiver.connected = false;  // the machine may get another address, and the socket with it
    receiver.retry_ns = now_ns + kRetry_ns;
  }
  return false;
}

SendOutcome UdpReceivers::send(std::span<const std::byte> datagram, std::int64_t now_ns) noexcept {
  SendOutcome outcome;
  for (Receiver& receiver : receivers_) {
    if (send_to(receiver, datagram, now_ns, outcome)) {
      if (receiver.good_ns == kNoTime_ns) receiver.good_ns = now_ns;
    } else {
      receiver.failing = true;
      receiver.good_ns = kNoTime_ns;
    }
  }
  return outcome;
}

std::vector<News> UdpReceivers::drain_news(std::int64_t now_ns) {
  std::vector<News> news;
  for (Receiver& receiver : receivers_) {
    if (receiver.failing && !receiver.reported) {
      receiver.reported = true;
      news.push_back(
          {.text = "sending to " + receiver.endpoint + " fails: " + why(receiver.error)});
    } else if (receiver.failing && receiver.good_ns != kNoTime_ns &&
               now_ns >= receiver.good_ns + kGood_ns) {
      receiver.failing = receiver.reported = false;
      news.push_back({.text = "sending to " + receiver.endpoint + " works again", .good = true});
    }
  }
  return news;
}

}  // namespace posed::output
