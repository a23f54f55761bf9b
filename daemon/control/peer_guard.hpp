// PeerGuard: who is connected to one of our listening sockets, and the means to cut one of them
// off.
//
// libzmq 4.3.4 bounds neither how many parts a message has (a part of two bytes on the wire takes
// 64 in memory, and HWM counts whole messages only) nor how many peers there are, and it cannot
// disconnect one of them. But it says which descriptor each connection has (socket monitor,
// ZMQ_SRCFD). The guard asks the kernel how much came in there since the last whole message, and
// shuts the connection down when that is too much; libzmq then closes it like one that was lost.
// An honest client reconnects by itself within about 0.1 s. (ZMTP heartbeats come to no message
// either: a client that sends one a second is cut once in some hours.)
//
// Connections by ipc:// have no such count in the kernel; the file's permission guards them.
// Cold, not thread-safe: belongs to the thread that owns the socket.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/control/zmq_handle.hpp"
#include "proto/frame/result.hpp"

namespace posed::control {

// How much a peer may make libzmq keep: bytes of one part (handshakes included), whole messages
// that wait for us, and the kernel's buffer behind them. Before bind.
[[nodiscard]] Result<> set_receive_limits(void* socket, std::int64_t part_bytes, int messages,
                                          int buffer_bytes);
// The descriptor of the connection that a message came through; -1 when it came through none.
[[nodiscard]] int source_of(const Message& message);

struct PeerLimits {
  const char* name = "";           // of the socket, for the log; unique in its context
  std::size_t most_peers = 0;      // a connection beyond them is cut at once
  std::uint64_t most_unheard = 0;  // bytes of all peers together that came to no whole message yet
};

class PeerGuard {
 public:
  // Call before `socket` is bound, so that no connection is missed; closed before the socket.
  [[nodiscard]] static Result<std::unique_ptr<PeerGuard>> open(void* context, void* socket,
                                                               const PeerLimits& limits);
  ~PeerGuard();
  PeerGuard(const PeerGuard&) = delete;
  PeerGuard& operator=(const PeerGuard&) = delete;

  // Becomes readable when connections come or go: then call look_now() before turn().
  [[nodiscard]] int fd() const noexcept { return monitor_fd_; }
  void look_now() noexcept { due_ns_ = 0; }
  // For zmq_poll.
  [[nodiscard]] void* monitor() const noexcept { return monitor_.get(); }

  // Takes note of who came and went, and cuts who must be cut; costs nothing before it is due.
  // Returns when it must be called next at the latest: soon while anybody is connected, else never.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);

  // A whole message came through the connection `fd`, of the peer with this User-Id.
  void heard(int fd, std::string_view user);
  // Ends the connection; `why` completes "a connection was cut: it ...".
  void cut(int fd, const char* why);
  // Ends every connection whose User-Id is not allowed any more, and those that said nothing yet:
  // nobody knows who they are, and who is still allowed comes back.
  void cut_unless(const std::function<bool(std::string_view user)>& allowed);

  [[nodiscard]] std::size_t peers() const noexcept { return peers_.size(); }
  // Whether `fd` is one of our connections now.
  [[nodiscard]] bool knows(int fd);
  [[nodiscard]] std::uint64_t cuts() const noexcept { return cuts_; }
  // Called with the descriptor of each connection that ended, before another can have it.
  std::function<void(int fd)> gone = [](int) {};

 private:
  struct Peer {
    std::uint64_t cookie = 0;  // the kernel's name of this connection: descriptors are used again
    std::uint64_t heard = 0;   // bytes received when its last whole message was taken
    std::string user;
    bool spoke = false;
    bool is_cut = false;
  };
  PeerGuard(void* socket, Socket monitor, int monitor_fd, const PeerLimits& limits);
  void hear_monitor();
  void admit(int fd);
  void inspect_all();
  void tell(const char* why);

  void* socket_;
  Socket monitor_;
  int monitor_fd_;
  PeerLimits limits_;
  std::map<int, Peer> peers_;  // by descriptor
  std::uint64_t cuts_ = 0;
  std::uint64_t untold_ = 0;  // cuts since the last line of the log
  std::int64_t now_ns_ = 0;
  std::int64_t due_ns_ = 0;
  std::int64_t told_ns_;
  std::int64_t inspected_ns_ = 0;
  std::uint64_t resident_before_ = 0;  // bytes
};

// How many connections each socket may have, of the process' limit of open files: a reserve stays
// for devices, logs and models.
struct PeerShares {
  std::size_t publish = 0, control = 0;
};
[[nodiscard]] PeerShares peer_shares();

// Raises the process' soft limit of open files to the hard one. Once, at the start.
void raise_file_limit() noexcept;

}  // namespace posed::control
