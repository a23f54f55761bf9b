#include "drivers/transport/udp.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/transport/socket.hpp"

namespace posed::drivers {
namespace {

constexpr std::size_t kBatch = 16;            // datagrams per system call
constexpr std::size_t kMaxDatagram = 65'507;  // bytes; the most that IPv4 carries
// Room for the kernel's time stamp and its count of drops.
constexpr std::size_t kControlBytes =
    CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));
constexpr int kMaxOldBatches = 1000;  // more than a socket's buffer holds
// Older datagrams are dropped and counted: posed was stopped meanwhile, and newest data wins. (The
// stamps are of the wall clock; where it is set, the few datagrams that wait at that moment count
// as new, or are dropped.)
constexpr std::int64_t kMaxAge_ns = kNanosPerSecond;
// While nothing comes of a group, it is joined again this often.
constexpr std::int64_t kRejoin_ns = 2 * kNanosPerSecond;
// A sender that says nothing for so long loses its socket to another one.
constexpr std::int64_t kSilence_ns = kNanosPerSecond;
static_assert(kMaxDatagram <= kMaxChunk);

std::int64_t to_ns(const timespec& time) noexcept {
  return std::int64_t{time.tv_sec} * kNanosPerSecond + time.tv_nsec;
}

// Returns the datagram's ancillary data of this type, if present.
template <typename Value>
RT_SAFE std::optional<Value> control_value(msghdr& header, int type) noexcept {
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != type) continue;
    Value value{};
    std::memcpy(&value, CMSG_DATA(part), sizeof value);
    return value;
  }
  return std::nullopt;
}

// Never waits. Returns whether the kernel took the datagram.
bool write_to(const Address& to, int fd, std::span<const std::byte> bytes) noexcept {
  const ssize_t sent =
      ::sendto(fd, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL, to.get(), to.size);
  return sent == static_cast<ssize_t>(bytes.size());
}

// A number that tells addresses with their ports apart (FNV-1a); never 0.
RT_SAFE std::uint64_t number_of(const Address& address) noexcept {
  const auto bytes = std::as_bytes(std::span(&address.storage, 1)).first(address.size);
  std::uint64_t number = 0xcbf29ce484222325U;
  for (const std::byte byte : bytes) {
    number = (number ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3U;
  }
  return (number & ~Chunk::kLink) | 1U;
}

struct Wanted {
  Address listen;
  std::optional<Address> group, to;
};

Result<Wanted> wanted_of(const UdpSocketSettings& socket, const UdpSettings& all) {
  Wanted wanted;
  const auto listen = TRY(listen_address(socket.listen, all.peers, "the senders'"));
  wanted.listen = listen;
  if (!socket.to.empty()) {
    const auto to = TRY(parse_endpoint(socket.to));
    wanted.to = to;
  }
  if (socket.group.empty()) return wanted;
  const auto group = TRY(parse_host(socket.group));
  if (!is_multicast(host_of(group))) {
    return misuse("'" + socket.group + "' should be a multicast address, like 239.255.42.99");
  }
  const bool same_family = group.storage.ss_family == listen.storage.ss_family;
  if (!same_family || is_loopback(host_of(listen))) {
    return misuse("to receive the group " + socket.group + ", listen on " +
                  (group.storage.ss_family == AF_INET6 ? "[::]" : "0.0.0.0") + ":PORT, not on " +
                  socket.listen);
  }
  wanted.group = group;
  return wanted;
}

// -1: see errno.
int open_listener(const Address& address, bool shared) noexcept {
  const int fd = bind_socket(address, SOCK_DGRAM, shared);
  if (fd < 0) return fd;
  const int yes = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  ::setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &yes, sizeof yes);
  ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &kUdpBuffer_bytes, sizeof kUdpBuffer_bytes);
  return fd;
}

}  // namespace

struct UdpTransport::Batch {
  std::array<mmsghdr, kBatch> message{};
  std::array<iovec, kBatch> part{};
  std::array<Address, kBatch> sender{};
  std::array<std::array<std::byte, kMaxDatagram>, kBatch> bytes{};
  alignas(cmsghdr) std::array<std::array<std::byte, kControlBytes>, kBatch> control{};

  // The kernel changes the headers with every call.
  RT_SAFE void prepare() noexcept {
    for (std::size_t i = 0; i < kBatch; ++i) {
      part[i] = {.iov_base = bytes[i].data(), .iov_len = bytes[i].size()};
      msghdr& header = message[i].msg_hdr;
      header = {};
      header.msg_name = &sender[i].storage;
      header.msg_namelen = sizeof sender[i].storage;
      header.msg_iov = &part[i];
      header.msg_iovlen = 1;
      header.msg_control = control[i].data();
      header.msg_controllen = control[i].size();
    }
  }
};

Result<> check_udp(const UdpSettings& settings) {
  if (settings.sockets.empty()) return misuse("name an address to listen on, like 127.0.0.1:1511");
  TRY(Peers::parse(settings.peers));
  for (const UdpSocketSettings& socket : settings.sockets) {
    TRY(wanted_of(socket, settings));
  }
  return {};
}

UdpTransport::UdpTransport() : batch_(std::make_unique<Batch>()) {}

UdpTransport::~UdpTransport() {
  for (const Socket& socket : sockets_) {
    if (socket.fd >= 0) ::close(socket.fd);
  }
  if (epoll_ >= 0) ::close(epoll_);
}

Result<std::unique_ptr<UdpTransport>> UdpTransport::open(const UdpSettings& settings) {
  TRY(check_udp(settings));
  std::unique_ptr<UdpTransport> self(new UdpTransport());
  self->data_place_ = settings.data_place;
  self->interface_ = settings.interface;
  self->peers_ = TRY(Peers::parse(settings.peers));
  self->epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  if (self->epoll_ < 0) {
    return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
  }
  for (const UdpSocketSettings& socket : settings.sockets) {
    TRY(self->add(socket, settings));
  }
  return self;
}

Result<> UdpTransport::add(const UdpSocketSettings& settings, const UdpSettings& all) {
  const auto wanted = TRY(wanted_of(settings, all));
  Socket& socket = sockets_.emplace_back();
  socket.to = wanted.to;
  socket.keeps_to = wanted.to.has_value();
  // Several programs may receive a group; a single address belongs to one.
  socket.fd = open_listener(wanted.listen, wanted.group.has_value());
  if (socket.fd < 0 || !watch(socket.fd)) {
    return fail("cannot listen on " + settings.listen + " (" + errno_text() +
                "); use an address of this machine and a port that is free");
  }
  if (!wanted.group) return {};
  socket.membership = TRY(Membership::join(socket.fd, *wanted.group, all.interface));
  return {};
}

bool UdpTransport::watch(int fd) const noexcept {
  epoll_event event{};
  event.events = EPOLLIN;
  return ::epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event) == 0;
}

std::string UdpTransport::endpoint(std::size_t socket) const {
  return endpoint_text(bound_address(sockets_[socket].fd));
}

// RT-safe except for its reads.
bool UdpTransport::receive(std::int64_t now_ns) noexcept {
  timespec wall{};
  ::clock_gettime(CLOCK_REALTIME, &wall);
  next_ = received_ = 0;
  for (std::size_t tried = 0; tried < sockets_.size() && received_ == 0; ++tried) {
    socket_ = (socket_ + 1) % sockets_.size();
    batch_->prepare();
    const int got =
        ::recvmmsg(sockets_[socket_].fd, batch_->message.data(), kBatch, MSG_DONTWAIT, nullptr);
    // An error is the answer to an earlier datagram of ours: it says nothing about this socket.
    if (got > 0) received_ = static_cast<std::size_t>(got);
  }
  batch_ns_ = now_ns;
  wall_ns_ = to_ns(wall);
  return received_ > 0;
}

// The kernel counts its drops from the socket's beginning and says nothing while there are none.
RT_SAFE void UdpTransport::read_control(std::size_t i, Chunk& chunk) noexcept {
  msghdr& header = batch_->message[i].msg_hdr;
  if (const auto stamp = control_value<timespec>(header, SCM_TIMESTAMPNS)) {
    const std::int64_t age_ns = wall_ns_ - to_ns(*stamp);
    chunk.arrival_ns = batch_ns_ - std::max<std::int64_t>(age_ns, 0);
  }
  if (const auto dropped = control_value<std::uint32_t>(header, SO_RXQ_OVFL)) {
    const std::uint32_t before = std::exchange(sockets_[socket_].dropped, *dropped);
    chunk.kernel_dropped += *dropped - (before <= *dropped ? before : 0);
  }
}

// Datagrams that the kernel dropped before are no loss either: they are counted into a Chunk that
// nobody gets.
Result<> UdpTransport::start(std::int64_t now_ns) {
  Chunk old;
  for (int batch = 0; batch < kMaxOldBatches && receive(now_ns); ++batch) {
    for (std::size_t i = 0; i < received_; ++i) read_control(i, old);
  }
  next_ = received_;
  joined_ns_ = now_ns;
  return {};
}

void UdpTransport::upkeep(std::int64_t now_ns) noexcept {
  if (const DataPlace said = said_.load(); said != followed_) follow(said);
  if (now_ns < std::max(joined_ns_, group_received_ns_.load()) + kRejoin_ns) return;
  joined_ns_ = now_ns;
  for (Socket& socket : sockets_) {
    if (socket.membership) socket.membership->renew(socket.fd);
  }
}

// Only groups: what goes to one address goes to where posed has asked for it.
void UdpTransport::follow(const DataPlace& said) {
  followed_ = said;
  const Address group = ipv4_address(said.group);
  if (!is_multicast(host_of(group))) return;
  const std::string there = host_text(group) + ", port " + std::to_string(said.port);
  for (Socket& socket : sockets_) {
    if (!socket.membership) continue;
    const bool same_port = port_of(bound_address(socket.fd)) == said.port;
    if (same_port && host_of(group) == host_of(socket.membership->group())) continue;
    if (same_port) {
      socket.membership->change_to(socket.fd, group);
    } else if (const auto moved = move(socket, group, said.port); !moved) {
      note_ = "the device sends to the group " + there + ", but " + moved.error().text();
      continue;
    }
    note_ = "the device sends to the group " + there + ", which is joined now";
  }
}

// The socket of the other port takes the number of the old one, which another thread may be
// reading.
Result<> UdpTransport::move(Socket& socket, const Address& group, std::uint32_t port) {
  const std::string listen = host_text(bound_address(socket.fd)) + ':' + std::to_string(port);
  const auto address = TRY(parse_endpoint(listen));
  const int fd = open_listener(address, true);
  if (fd < 0) return fail("posed cannot listen on " + listen + " (" + errno_text() + ")");
  auto joined = Membership::join(fd, group, interface_);
  const bool moved = joined && ::dup3(fd, socket.fd, O_CLOEXEC) >= 0 && watch(socket.fd);
  ::close(fd);
  if (!joined) return std::unexpected(joined.error());
  if (!moved) return fail("posed cannot open its port (" + errno_text() + ")");
  socket.membership = *joined;
  return {};
}

// A sender is a program, known by its address and port. One that is sent to (`to`) answers from
// several ports, and one may have a new port for each datagram: its earlier ports do not come back,
// as those of two programs do.
RT_SAFE bool UdpTransport::owns(Socket& socket, const Address& address) noexcept {
  const Host host = host_of(address);
  const std::uint16_t port = port_of(address);
  const bool free =
      socket.received_ns == kNoTime_ns || batch_ns_ - socket.received_ns >= kSilence_ns;
  const bool same_host = socket.received_ns != kNoTime_ns && host == socket.sender;
  const bool same_port = same_host && port == socket.port;
  const bool new_port = same_host && socket.datagrams == 1 && port != socket.port_before;
  if (!free && !same_port && !new_port && !(same_host && socket.keeps_to)) {
    if (same_host && second_sender_.load() == SecondSender::kNone) {
      second_sender_.store(SecondSender::kSeen);
    }
    return false;
  }
  if (!same_port) {
    socket.port_before = same_host && !free ? socket.port : std::uint16_t{0};
    socket.datagrams = 0;
    socket.is_of_use = false;
  }
  ++socket.datagrams;
  socket.sender = host;
  socket.port = port;
  socket.received_ns = batch_ns_;
  return true;
}

RT_SAFE void UdpTransport::decoded(bool used) noexcept {
  Socket& socket = sockets_[socket_];
  socket.is_of_use = socket.is_of_use || used;
  if (!socket.is_of_use) socket.received_ns = kNoTime_ns;
}

std::string UdpTransport::consume_note() {
  if (!note_.empty()) return std::exchange(note_, {});
  if (second_sender_.load() != SecondSender::kSeen) return {};
  second_sender_.store(SecondSender::kTold);
  return "two programs on one computer send to this port: the first is heard until it is silent for"
         " a second; give each a port and a source of its own";
}

// RT-safe except for its reads. A flood of datagrams to be dropped ends the call after one batch.
Chunk UdpTransport::read(std::int64_t now_ns) noexcept {
  Chunk chunk;
  if (next_ >= received_ && !receive(now_ns)) return chunk;
  while (next_ < received_) {
    const std::size_t i = next_++;
    chunk.arrival_ns = kNoTime_ns;
    mmsghdr& message = batch_->message[i];
    Address& sender = batch_->sender[i];
    sender.size = message.msg_hdr.msg_namelen;
    read_control(i, chunk);
    Socket& socket = sockets_[socket_];
    if (!peers_.allow(host_of(sender)) || !owns(socket, sender)) {
      ++chunk.foreign;
      continue;
    }
    const bool is_old = chunk.arrival_ns != kNoTime_ns && batch_ns_ - chunk.arrival_ns > kMaxAge_ns;
    if (is_old || message.msg_len == 0 || (message.msg_hdr.msg_flags & MSG_TRUNC) != 0) {
      ++(is_old ? chunk.kernel_dropped : chunk.damaged);
      decoded(false);
      continue;
    }
    if (!socket.keeps_to) socket.to = sender;
    if (socket.membership) group_received_ns_.store(now_ns);
    assert(message.msg_len <= batch_->bytes[i].size());
    chunk.bytes = std::span(batch_->bytes[i]).first(message.msg_len);
    chunk.socket = static_cast<std::uint8_t>(socket_);
    chunk.sender = number_of(sender);
    if (socket_ == 0 && data_place_ != nullptr) {
      if (const auto said = data_place_(chunk.bytes)) said_.store(*said);
    }
    break;
  }
  return chunk;
}

// RT-safe except for its write.
bool UdpTransport::send(std::span<const std::byte> bytes, std::uint8_t socket) noexcept {
  if (socket >= sockets_.size() || !sockets_[socket].to) return false;
  return write_to(*sockets_[socket].to, sockets_[socket].fd, bytes);
}

}  // namespace posed::drivers
