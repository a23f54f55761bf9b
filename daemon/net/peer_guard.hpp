// PeerGuard: who is connected to one of our listening sockets, and the means to cut one of them
// off.
//
// libzmq 4.3.4 bounds neither how many parts a message has (a part of two bytes on the wire takes
// 64 in memory, and HWM counts whole messages only) nor how many peers there are, and it cannot
// disconnect one of them. But it says which descriptor each connection has (socket monitor,
// ZMQ_SRCFD). The guard asks the kernel how much came in there since the last whole message, and
// shuts the connection down when that is too much; libzmq then closes it like one that was lost.
// An honest client reconnects by itself within about 0.1 s. (ZMTP heartbeats come to no message
// either: a client that sends one a second is cut about every
// 45 minutes.)
//
// Connections by ipc:// have no such count in the kernel; the file's permission guards them.
// A thread of its own looks: libzmq takes subscriptions in for as long as they come, and may hold
// the publisher's thread meanwhile. Cold; every call from any thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/net/zmq_handle.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"

namespace posed::net {

// How much a peer may make libzmq keep: bytes of one part (handshakes included), whole messages
// that wait for us, and the kernel's buffer behind them. Before bind.
[[nodiscard]] Result<> set_receive_limits(void* socket, std::int64_t part_bytes, int messages,
                                          int buffer_bytes);
// The descriptor of the connection that a message came through; -1 when it came through none.
[[nodiscard]] int source_of(const Message& message);

class ZapAuthenticator;

struct PeerLimits {
  const char* name = "";       // of the socket, for the log
  std::size_t most_peers = 0;  // a connection beyond them is cut at once
  // Bytes that came to no whole message yet: of one peer, and of all together.
  std::uint64_t max_unheard = 0;
  std::uint64_t max_unheard_of_all = 0;
  ZapAuthenticator* authenticator = nullptr;  // slowed down when a peer is cut for what it sent
};

class PeerGuard {
 public:
  // Call before `socket` is bound, so that no connection is missed; closed before the socket.
  [[nodiscard]] static Result<std::unique_ptr<PeerGuard>> open(void* context, void* socket,
                                                               const PeerLimits& limits);
  ~PeerGuard();
  PeerGuard(const PeerGuard&) = delete;
  PeerGuard& operator=(const PeerGuard&) = delete;

  // A whole message came through the connection `fd`, of the peer with this User-Id.
  void heard(int fd, std::string_view user);
  // Ends the connection; `why` completes "a connection was cut: it ...".
  void cut(int fd, const char* why);
  // Ends every connection whose User-Id is not allowed any more, and those that said nothing yet:
  // nobody knows who they are, and who is still allowed comes back.
  void cut_unless(const std::function<bool(std::string_view user)>& allowed);

  // Whether `fd` is one of our connections now.
  [[nodiscard]] bool knows(int fd);
  // The descriptors of the connections that ended since the last call.
  [[nodiscard]] std::vector<int> take_gone();
  [[nodiscard]] std::size_t peers() const;
  [[nodiscard]] std::uint64_t cuts() const;

 private:
  struct Peer {
    std::uint64_t cookie = 0;  // the kernel's name of this connection: descriptors are used again
    std::uint64_t heard = 0;   // bytes received when its last whole message was taken
    std::string user;
    bool spoke = false;
    bool is_cut = false;
  };
  PeerGuard(void* socket, Socket monitor, std::unique_ptr<system::EventFd> wake,
            std::unique_ptr<system::Poller> poller, const PeerLimits& limits);
  void serve();
  // The rest under mutex_.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);  // returns when the next is due
  void hear_monitor();
  void admit(int fd);
  void inspect_all();
  void cut_now(int fd, const char* why);
  void cut_offender(int fd, const char* why);  // and slows down whoever comes next
  void log_cut(const char* why);

  void* socket_;
  Socket monitor_;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  PeerLimits limits_;
  mutable std::mutex mutex_;
  std::map<int, Peer> peers_;  // by descriptor
  std::vector<int> gone_;
  std::uint64_t cuts_ = 0;
  std::uint64_t unreported_ = 0;  // cuts since the last line of the log
  std::int64_t reported_ns_;
  std::int64_t inspected_ns_ = 0;
  std::uint64_t resident_before_ = 0;  // bytes
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// How many connections each socket may have, of the process' limit of open files: a reserve stays
// for devices, logs and models.
struct PeerShares {
  std::size_t publish = 0, control = 0;
};
[[nodiscard]] PeerShares peer_shares();

// Raises the process' soft limit of open files to the hard one. Once, at the start.
void raise_file_limit() noexcept;

}  // namespace posed::net
