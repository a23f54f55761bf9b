// DaemonLink: the bridge's connections to the daemon, a SUB and a DEALER socket of ZeroMQ that its
// io_context waits for. They connect in the background and again after a loss; what the daemon
// publishes and replies goes to the Hub, as does whether it answers and lets itself be controlled.
// One thread: the one that runs the io_context. Cold.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

#include "daemon/tools/link/daemon_socket.hpp"
#include "daemon/tools/view/hub.hpp"
#include "proto/frame/result.hpp"

namespace posed::view {

struct LinkOptions {
  link::Peer publish{};            // the daemon's publish endpoint
  std::string control{};           // its control endpoint, with the same keys; empty: none is used
  std::string read_only_reason{};  // why nothing may be changed; empty: it may
};

// One connected socket and its news.
class WatchedSocket {
 public:
  // `drain` reads what waits and returns false if more may wait.
  static Result<std::unique_ptr<WatchedSocket>> open(boost::asio::io_context& io, void* context,
                                                     int type, const link::Peer& peer,
                                                     std::function<bool()> drain);
  ~WatchedSocket();
  WatchedSocket(const WatchedSocket&) = delete;
  WatchedSocket& operator=(const WatchedSocket&) = delete;

  [[nodiscard]] link::DaemonSocket& socket() noexcept { return socket_; }
  // Reads what waits, and goes on when more comes. Call once at the start and from time to time.
  void turn();
  // Does what turn() does as soon as the caller is done. Call after every send, because libzmq may
  // have taken the signal that something waits.
  void turn_soon();

 private:
  WatchedSocket(link::DaemonSocket socket, boost::asio::io_context& io, int fd,
                std::function<bool()> drain);
  void wait();

  link::DaemonSocket socket_;
  std::function<bool()> drain_;
  boost::asio::posix::stream_descriptor descriptor_;  // libzmq's own, not to be closed here
  bool waiting_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // false once this has gone
};

class DaemonLink {
 public:
  // `io`, `context` and `hub` outlive the link.
  static Result<std::unique_ptr<DaemonLink>> open(boost::asio::io_context& io, void* context,
                                                  const LinkOptions& options, Hub& hub);

  // Whether poses, samples and events are wanted, because a page is open.
  void want_streams(bool wanted);
  // Sends a request (Hub::Ask).
  [[nodiscard]] bool ask(std::uint64_t ticket, std::string_view request);
  // Looks whether the daemon still answers. Call some times a second.
  void turn(std::int64_t now_ns);

 private:
  DaemonLink(boost::asio::io_context& io, void* context, const LinkOptions& options, Hub& hub)
      : io_(io), context_(context), options_(options), hub_(hub) {}
  Result<> open_publish();
  Result<> open_control();
  Result<> subscribe(const char* prefix, bool on);
  [[nodiscard]] bool receive_messages();
  [[nodiscard]] bool receive_replies();
  void handle_news(std::int64_t now_ns);
  void check_control(std::int64_t now_ns);
  void connect_anew(std::int64_t now_ns);
  void ask_for_status(std::int64_t now_ns);
  void handle_status(std::string_view reply);

  boost::asio::io_context& io_;
  void* context_;
  LinkOptions options_;
  Hub& hub_;
  std::unique_ptr<WatchedSocket> publish_, control_;  // control: null if nothing may be changed
  bool wants_streams_ = false;
  bool control_stood_ = false;                         // as of the last turn
  std::uint64_t publish_ends_ = 0, control_ends_ = 0;  // of connections, that are known
  std::int64_t received_ns_ = 0;                       // the last message
  std::optional<std::int64_t> asked_ns_{};             // the status request without a reply
  link::Retry publish_again_{}, control_again_{};
};

}  // namespace posed::view
