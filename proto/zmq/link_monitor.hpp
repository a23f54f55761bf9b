// LinkMonitor: the one connection of a socket that connects to a daemon. It receives the socket's
// messages, knows whether the connection is established and why the daemon refuses this client, and
// ends a connection whose peer would fill the memory.
//
// libzmq counts neither the parts of a message nor its bytes against the high-water mark, and an
// empty part (two bytes on the wire) takes 64 in memory. So a thread asks the kernel every 10 ms
// how many bytes have arrived, subtracts those that were received as messages, and when too many
// are left in all links of the process together, shuts down the connection with the most; libzmq
// frees them and connects again. That bounds the memory whoever the peers are: whoever takes a
// daemon's port while it is away can be anybody. The kernel has no such count for ipc://
// connections; they are protected by the file's permissions. One thread uses a LinkMonitor. Cold.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>

#include "proto/frame/event_fd.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/socket_events.hpp"

namespace posed::net {

// Why a daemon will never admit a client, as far as the connection shows.
enum class Refusal : std::uint8_t {
  kNone,
  kKeyNotAllowed,   // the key is not on the daemon's list, or lacks the right
  kTalksNoKeys,     // the daemon uses no keys, or is something else
  kHangsUp,         // the server's key is not the daemon's, or the daemon just ended
  kWantsKey,        // the daemon uses keys, and this client none
  kOtherSocket,     // the socket there is of another kind, such as control's for a subscriber
  kHangsUpKeyless,  // kWantsKey or kOtherSocket
};

// Bytes of one part; the stats of 256 streams have about 200 KB. libzmq ends the connection at a
// larger one.
inline constexpr std::int64_t kMaxReceivedPart = 1024 * 1024;
// Bytes that may have arrived in all links without being received: more than a part, and as many
// empty parts as take 48 MB.
inline constexpr std::uint64_t kMaxUnreceived = 3 * 1024 * 1024 / 2;

class LinkMonitor {
 public:
  // Call before the socket connects; destroy the monitor before the socket. `with_key`: the client
  // uses CURVE. Limits the parts of the socket's messages.
  static Result<std::unique_ptr<LinkMonitor>> open(void* context, void* socket, bool with_key);
  ~LinkMonitor();
  LinkMonitor(const LinkMonitor&) = delete;
  LinkMonitor& operator=(const LinkMonitor&) = delete;

  // The next part, if a message waits. Every part of the socket must be received here: the others
  // would count as never received.
  [[nodiscard]] bool receive(Message& part) noexcept;

  [[nodiscard]] int fd() const noexcept { return news_.fd(); }  // readable: events wait

  // Handles the events that wait, and returns why the daemon refuses this client, once for each
  // refusal; kNone: nothing new.
  [[nodiscard]] Refusal next_refusal();
  // As of the last next_refusal(): whether the connection stands, how often one has ended, and how
  // many of them ended here because the peer sent too much.
  [[nodiscard]] bool established() const noexcept { return told_.established; }
  [[nodiscard]] std::uint64_t ends() const noexcept { return told_.ends; }
  [[nodiscard]] std::uint64_t cuts() const noexcept { return told_.cuts; }

 private:
  struct State {
    bool established = false;
    std::uint64_t ends = 0;
    std::uint64_t cuts = 0;
  };
  LinkMonitor(void* socket, SocketEvents events, bool with_key);
  void watch();
  // Whether no message waits; if so, notes it.
  [[nodiscard]] bool is_empty() noexcept;
  // Each function below must be called with mutex_ held.
  void handle_events();
  [[nodiscard]] Refusal handle(std::uint16_t event, int value);
  [[nodiscard]] bool is_connected() const noexcept { return fd_ >= 0; }
  void inspect();
  // Tells all links how much waits in this one; returns whether it may stay.
  [[nodiscard]] bool note_unreceived(std::uint64_t bytes) noexcept;

  void* socket_;
  const bool with_key_;
  RawEventFd news_, wake_;
  State told_;  // of the owner's thread
  std::mutex mutex_;
  SocketEvents events_;
  State state_;
  Refusal refusal_ = Refusal::kNone;  // not told yet
  int hang_ups_ = 0;                  // in a row, before the handshake
  bool failure_known_ = false;        // libzmq has reported why this connection's handshake failed
  int fd_ = -1;                       // the connection's descriptor; -1: none
  std::uint64_t cookie_ = 0;          // and its id
  bool is_cut_ = false;
  std::uint64_t unreceived_ = 0;  // bytes, as of the last look; all links read it
  // Bytes that have arrived: in earlier connections, in this one as of the last look, and in all
  // when nothing waited to be received; and how many belong to parts that were received.
  std::uint64_t before_ = 0, arrived_ = 0, when_empty_ = 0, accounted_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::net
