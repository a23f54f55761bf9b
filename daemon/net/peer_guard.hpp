// PeerGuard knows who is connected to one of the daemon's listening sockets, and can disconnect a
// single peer.
//
// libzmq 4.3.4 limits neither how many parts a message has (a part of two bytes on the wire takes
// 64 in memory, and the high-water mark counts whole messages only) nor how many peers there are,
// and it cannot disconnect a peer. But it reports the descriptor of each connection (socket
// monitor, ZMQ_SRCFD). The guard asks the kernel how many bytes have arrived there since received()
// was last called for it, and shuts the connection down when there are too many; libzmq then closes
// it like a lost connection. An honest client reconnects by itself within about 0.1 s. ZMTP
// heartbeats never become a message either: a client that sends one a second is disconnected now
// and then.
//
// The kernel has no such byte count for ipc:// connections; they are protected by the file's
// permissions. The guard has its own thread, because libzmq processes subscriptions for as long as
// they come and may block the publisher's thread meanwhile. Cold; every call from any thread.
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

#include "daemon/system/event_fd.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/socket_events.hpp"

namespace posed::net {

// Limits the memory that a peer can make libzmq use: the bytes of one part (handshakes included),
// the whole messages that wait to be read, and the kernel's buffer behind them. Call before bind.
Result<> set_receive_limits(void* socket, std::int64_t part_bytes, int messages, int buffer_bytes);
// Returns the descriptor of the connection through which `message` came; -1 if there is none.
[[nodiscard]] int source_of(const Message& message);

class ZapAuthenticator;

struct PeerLimits {
  const char* name = "";      // the socket's name in log lines; outlives the guard
  std::size_t max_peers = 0;  // further connections are cut at once
  // Limits of the bytes that have not yet become a whole message: of one peer, and of all peers
  // together, of which the one with most is then cut.
  std::uint64_t max_unfinished = 0;
  std::uint64_t max_unfinished_of_all = 0;
  ZapAuthenticator* authenticator = nullptr;  // slowed down when a peer is cut for what it
                                              // sent; outlives the guard
};

class PeerGuard {
 public:
  // Call before `socket` is bound, so that no connection is missed. Destroy the guard before the
  // socket.
  static Result<std::unique_ptr<PeerGuard>> open(void* context, void* socket,
                                                 const PeerLimits& limits);
  ~PeerGuard();
  PeerGuard(const PeerGuard&) = delete;
  PeerGuard& operator=(const PeerGuard&) = delete;

  // A whole message came through the connection `fd`, from the peer with this User-Id; that of a
  // connection's first message stays.
  void received(int fd, std::string_view user);
  // Closes the connection, if it is one, and slows down the next handshakes; `why` completes the
  // sentence "a connection was cut: it ...".
  void cut(int fd, const char* why);
  // Closes every connection whose User-Id is no longer allowed, and those that have not sent a
  // message yet: their user is unknown, and one that is still allowed reconnects.
  void cut_unless(const std::function<bool(std::string_view user)>& allowed);

  // Whether `fd` is a connection of this socket at the moment.
  [[nodiscard]] bool knows(int fd);
  // The descriptors of the connections that have ended since the last call; call it now and then,
  // for they are kept until then.
  [[nodiscard]] std::vector<int> drain_ended();
  [[nodiscard]] std::size_t peers() const;
  [[nodiscard]] std::uint64_t cuts() const;

 private:
  struct Peer {
    std::uint64_t cookie = 0;  // the kernel's id of this connection, because descriptors are reused
    std::uint64_t received = 0;  // bytes received when its last whole message was read
    std::string user;
    bool spoke = false;
    bool is_cut = false;
  };
  PeerGuard(SocketEvents events, std::unique_ptr<system::EventFd> wake,
            std::unique_ptr<system::Poller> poller, const PeerLimits& limits);
  void serve();
  // Each function below must be called with mutex_ held.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);  // returns when the next turn is due
  void receive_events();
  void admit(int fd);
  [[nodiscard]] bool is_inspection_due(std::int64_t now_ns);
  void inspect_all();
  void cut_now(int fd, const char* why);
  void cut_offender(int fd, const char* why);  // and slows down the next handshakes

  SocketEvents events_;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<system::Poller> poller_;
  PeerLimits limits_;
  mutable std::mutex mutex_;
  std::map<int, Peer> peers_;  // by descriptor
  std::vector<int> gone_;
  std::uint64_t cuts_ = 0;
  std::int64_t inspected_ns_ = 0;
  std::uint64_t resident_before_ = 0;  // bytes
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// How many connections each socket may have within the process's limit of open files (some stay
// reserved for devices, logs and models), but at least four. Call raise_file_limit() first.
struct PeerShares {
  std::size_t publish = 0, control = 0;
};
[[nodiscard]] PeerShares peer_shares();

// Raises the process's soft limit of open files to the hard limit. Call once, at the start.
void raise_file_limit() noexcept;

}  // namespace posed::net
