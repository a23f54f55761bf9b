#include "daemon/output/line_clients.hpp"

#include <array>
#include <cerrno>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

#include "drivers/transport/socket.hpp"

namespace posed::output {
namespace {

constexpr int kWaiting = 16;    // connections that the kernel keeps until they are let in
constexpr int kMaxAtOnce = 16;  // that are let in or refused in one look
// Bytes of each person, a few lines: what the kernel keeps for a client that does not read is old
// when it does.
constexpr int kLineBuffer = 16 * 1024;
constexpr std::int64_t kPatience_ns = 2 * kNanosPerSecond;

// Whether the other side has closed the connection; discards what it has sent.
bool has_closed(int fd) noexcept {
  std::array<char, 4096> ignored{};
  const ssize_t size = ::recv(fd, ignored.data(), ignored.size(), MSG_DONTWAIT);
  return size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR);
}

}  // namespace

Result<LineClients> LineClients::open(const std::string& listen,
                                      const std::vector<std::string>& peers, std::size_t people) {
  const auto address = TRY(drivers::listen_address(listen, peers, "the clients'"));
  auto allowed = TRY(drivers::Peers::parse(peers));
  const auto fd = TRY(drivers::listen_on(address, listen, kWaiting));
  LineClients clients;
  clients.listener_ = fd;
  clients.peers_ = std::move(allowed);
  clients.buffer_bytes_ = static_cast<int>(people) * kLineBuffer;
  drivers::Address bound;
  ::getsockname(fd, bound.get(), &bound.size);
  clients.endpoint_ = drivers::endpoint_text(bound);
  return clients;
}

LineClients::LineClients(LineClients&& other) noexcept
    : listener_(std::exchange(other.listener_, -1)),
      endpoint_(std::move(other.endpoint_)),
      greeting_(std::move(other.greeting_)),
      peers_(std::move(other.peers_)),
      buffer_bytes_(other.buffer_bytes_),
      clients_(std::exchange(other.clients_, {})),
      reported_ns_(other.reported_ns_) {}

LineClients::~LineClients() {
  for (const Client& client : clients_) ::close(client.fd);
  if (listener_ >= 0) ::close(listener_);
}

void LineClients::set_greeting(std::string greeting) {
  if (greeting == greeting_) return;
  greeting_ = std::move(greeting);
  for (Client& client : clients_) client.gone = client.gone || client.greeted;
  remove_gone();
}

bool LineClients::write(Client& client, std::string_view text) {
  const ssize_t sent = ::send(client.fd, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent < 0) {
    client.gone = errno != EAGAIN && errno != EINTR;
    return false;
  }
  client.rest = text.substr(sent);
  client.stuck_ns = kNoTime_ns;
  return true;
}

bool LineClients::write_rest(Client& client) {
  if (client.rest.empty()) return true;
  const std::string rest = std::exchange(client.rest, {});
  if (!write(client, rest)) client.rest = rest;
  return client.rest.empty();
}

SendOutcome LineClients::send(std::string_view line, std::int64_t now_ns) {
  SendOutcome outcome;
  for (Client& client : clients_) {
    if (!client.greeted && !greeting_.empty()) client.greeted = write(client, greeting_);
    const bool ready = client.greeted || greeting_.empty();
    if (ready && write_rest(client) && write(client, line)) {
      ++outcome.sent;
    } else if (client.gone) {
      ++outcome.failed;
    } else {
      ++outcome.dropped;
      if (client.stuck_ns == kNoTime_ns) client.stuck_ns = now_ns;
    }
  }
  remove_gone();
  return outcome;
}

void LineClients::refuse(const drivers::Address& peer, const std::string& why, std::int64_t now_ns,
                         std::vector<News>& news) {
  // Whoever may connect may do so all the time.
  if (reported_ns_ != kNoTime_ns && now_ns < reported_ns_ + kNanosPerSecond) return;
  reported_ns_ = now_ns;
  news.push_back({.text = drivers::host_text(peer) + " was refused: " + why});
}

void LineClients::let_in(std::int64_t now_ns, std::vector<News>& news) {
  for (int i = 0; i < kMaxAtOnce; ++i) {
    drivers::Address peer;
    const int fd = ::accept4(listener_, peer.get(), &peer.size, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) return;  // also without a descriptor: then it waits
    if (!peers_.allow(drivers::host_of(peer))) {
      ::close(fd);
      refuse(peer, "it is not among the peers", now_ns, news);
    } else if (clients_.size() == kMaxClients) {
      ::close(fd);
      refuse(peer, "there are " + std::to_string(kMaxClients) + " clients, the most there may be",
             now_ns, news);
    } else {
      drivers::keep_alive(fd);
      ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &buffer_bytes_, sizeof buffer_bytes_);
      clients_.push_back({.fd = fd, .from = drivers::endpoint_text(peer)});
    }
  }
}

std::vector<News> LineClients::look(std::int64_t now_ns) {
  std::vector<News> news;
  for (Client& client : clients_) {
    static_cast<void>(write_rest(client));
    client.gone = client.gone || has_closed(client.fd);
    if (client.gone || client.stuck_ns == kNoTime_ns) continue;
    if (now_ns < client.stuck_ns + kPatience_ns) continue;
    client.gone = true;
    news.push_back({.text = client.from + " was disconnected: it took nothing for 2 s"});
  }
  remove_gone();
  let_in(now_ns, news);
  return news;
}

void LineClients::remove_gone() {
  std::erase_if(clients_, [](const Client& client) {
    if (client.gone) ::close(client.fd);
    return client.gone;
  });
}

}  // namespace posed::output
