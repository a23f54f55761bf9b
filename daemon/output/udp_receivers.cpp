#include "daemon/output/udp_receivers.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <linux/errqueue.h>
#include <netinet/in.h>
#include <unistd.h>

#include "drivers/transport/socket.hpp"

namespace posed::output {
namespace {

constexpr std::int64_t kRetry_ns = kNanosPerSecond;
// The system looks for a machine that is not there for three seconds before it says so.
constexpr std::int64_t kGood_ns = 5 * kNanosPerSecond;
constexpr std::size_t kMaxMessages = 1024;  // that the system takes in one call (UIO_MAXIOV)

// Connected sockets, because only those learn that nobody listens at the other side. Without the
// last options they do not learn that the machine is not there, or that the interface's own queue
// had no room.
Result<int> open_socket(const drivers::Address& address) {
  const int fd = drivers::open_socket(address, SOCK_DGRAM);
  if (fd < 0) return fail("cannot open a UDP socket (" + errno_text() + ")");
  const int yes = 1;  // who writes down a broadcast address wants that
  ::setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
  ::setsockopt(fd, IPPROTO_IP, IP_RECVERR, &yes, sizeof yes);
  ::setsockopt(fd, IPPROTO_IPV6, IPV6_RECVERR, &yes, sizeof yes);
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

// The network's answer to a datagram, from a message of the socket's error queue (ip(7)); 0: none.
int answer_in(msghdr& message) noexcept {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    const bool v4 = part->cmsg_level == IPPROTO_IP && part->cmsg_type == IP_RECVERR;
    const bool v6 = part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_RECVERR;
    if (!v4 && !v6) continue;
    sock_extended_err what{};
    std::memcpy(&what, CMSG_DATA(part), sizeof what);
    if (what.ee_origin != SO_EE_ORIGIN_LOCAL) return static_cast<int>(what.ee_errno);
  }
  return 0;
}

}  // namespace

void Datagrams::add(std::span<const std::byte> datagram) {
  bytes_.insert(bytes_.end(), datagram.begin(), datagram.end());
  bytes_of_.push_back(datagram.size());
}

std::span<mmsghdr> Datagrams::messages() {
  pieces_.resize(bytes_of_.size());
  messages_.resize(bytes_of_.size());
  std::byte* at = bytes_.data();
  for (std::size_t i = 0; i < bytes_of_.size(); ++i) {
    pieces_[i] = {.iov_base = at, .iov_len = bytes_of_[i]};
    messages_[i] = {};
    messages_[i].msg_hdr.msg_iov = &pieces_[i];
    messages_[i].msg_hdr.msg_iovlen = 1;
    at += bytes_of_[i];
  }
  return messages_;
}

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

bool UdpReceivers::take_answers(Receiver& receiver) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < kMaxMessages; ++i) {  // who forges answers without end is left alone
    alignas(cmsghdr) std::array<std::byte, 256> about{};
    msghdr message{};
    message.msg_control = about.data();
    message.msg_controllen = about.size();
    if (::recvmsg(receiver.fd, &message, MSG_ERRQUEUE | MSG_DONTWAIT) < 0) break;
    const int answer = answer_in(message);
    if (answer == 0) continue;
    any = true;
    receiver.error = answer;
    ++receiver.refused;
  }
  return any;
}

void UdpReceivers::retry_first(Receiver& receiver, const mmsghdr& datagram, int error,
                               std::int64_t now_ns, SendOutcome& outcome) noexcept {
  const bool answered = take_answers(receiver);
  // For a lack of memory the queue may be without an answer that is known.
  if (!answered && error == ECONNREFUSED) {
    receiver.error = error;
    ++receiver.refused;
  }
  if (answered || error == 0 || error == ECONNREFUSED) {  // this datagram may go all the same
    if (::sendmsg(receiver.fd, &datagram.msg_hdr, MSG_NOSIGNAL) >= 0) {
      ++outcome.sent;
      return;
    }
    error = errno;
  }
  receiver.error = error;
  if (error == EAGAIN || error == ENOBUFS) {
    ++outcome.dropped;
    return;
  }
  ++outcome.failed;
  if (take_answers(receiver)) return;
  receiver.connected = false;  // the machine may get another address, and the socket with it
  receiver.retry_ns = now_ns + kRetry_ns;
}

void UdpReceivers::send_to(Receiver& receiver, std::span<mmsghdr> datagrams, std::int64_t now_ns,
                           SendOutcome& outcome) noexcept {
  while (!datagrams.empty()) {
    if (!is_connected(receiver, now_ns)) {
      outcome.failed += datagrams.size();
      return;
    }
    const std::size_t count = std::min(datagrams.size(), kMaxMessages);
    const int result =
        ::sendmmsg(receiver.fd, datagrams.data(), static_cast<unsigned>(count), MSG_NOSIGNAL);
    const std::size_t taken = std::max(result, 0);
    outcome.sent += taken;
    datagrams = datagrams.subspan(taken);
    if (taken == count) continue;
    retry_first(receiver, datagrams.front(), result < 0 ? errno : 0, now_ns, outcome);
    datagrams = datagrams.subspan(1);
  }
}

SendOutcome UdpReceivers::send(Datagrams& datagrams, std::int64_t now_ns) {
  SendOutcome all;
  const std::span<mmsghdr> messages = datagrams.messages();
  for (Receiver& receiver : receivers_) {
    SendOutcome outcome;
    send_to(receiver, messages, now_ns, outcome);
    const std::uint64_t refused = std::min(receiver.refused, outcome.sent);
    receiver.refused -= refused;
    outcome.sent -= refused;
    outcome.failed += refused;
    if (outcome.dropped + outcome.failed > 0) {
      receiver.failing = true;
      receiver.good_ns = kNoTime_ns;
    } else if (outcome.sent > 0 && receiver.good_ns == kNoTime_ns) {
      receiver.good_ns = now_ns;
    }
    all.sent += outcome.sent;
    all.dropped += outcome.dropped;
    all.failed += outcome.failed;
  }
  datagrams.bytes_.clear();
  datagrams.bytes_of_.clear();
  return all;
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
