// What the commands share that talk to a running daemon: their options, a connection that reports
// why it cannot be established, whether the daemon is silent, messages as JSON, and Ctrl-C. Cold.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "daemon/tools/link/daemon_socket.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace CLI {
class App;
}

namespace google::protobuf {
class Message;
}

namespace posed::tools {

// Heartbeat: whether a daemon that sends stats every second still does. The time is a parameter, so
// a test can choose it.
class Heartbeat {
 public:
  explicit Heartbeat(std::int64_t now_ns) : last_ns_(now_ns) {}

  void beat(std::int64_t now_ns);
  // How long the daemon has been silent [s], if that is longer than normal; empty while it answers.
  // Before the first message a shorter silence counts, because a user is waiting.
  [[nodiscard]] std::optional<double> silent_s(std::int64_t now_ns) const;
  [[nodiscard]] bool ever_beat() const { return ever_beat_; }

  // For output as lines: the silence, whenever a line about it is due (at once, then after twice,
  // four times, ... the time).
  [[nodiscard]] std::optional<double> silence_to_report(std::int64_t now_ns);
  // How long the daemon was silent [s], returned once after a silence that was reported.
  [[nodiscard]] std::optional<double> return_to_report();

 private:
  std::int64_t last_ns_;
  bool ever_beat_ = false;
  double reported_s_ = 0.0;         // the last silence that was reported; 0: none
  std::optional<double> returned_;  // not reported yet
};

// Where a daemon listens by default.
inline constexpr const char* kOwnPublish = "tcp://127.0.0.1:5570";
inline constexpr const char* kOwnControl = "tcp://127.0.0.1:5571";

using ClientOptions = link::Peer;

// Adds --connect (default `endpoint`), --key and --server-key.
void add_client_options(CLI::App& command, ClientOptions& options, const char* endpoint);

// A connected socket that monitors its own connection. One that subscribes is opened anew five
// seconds after its connection has ended, because libzmq gives up when somebody else had the
// daemon's port meanwhile; one for requests is not, because nobody knows which of them took effect.
class Connection {
 public:
  // `type` is ZMQ_SUB or ZMQ_DEALER. Returns at once; libzmq connects in the background, and
  // reconnects when necessary.
  static Result<Connection> open(const ClientOptions& options, int type);

  // Of a ZMQ_SUB: the topics that begin with `prefix` are wanted, or no longer.
  Result<> subscribe(const std::string& prefix, bool wanted = true);

  [[nodiscard]] const std::string& endpoint() const { return socket_.peer().endpoint; }
  // Returns false if the request cannot be sent.
  [[nodiscard]] bool send(const std::string& request);
  // The next part, if a message waits. Whatever comes must be received here.
  [[nodiscard]] bool receive(net::Message& part) { return socket_.receive(part); }
  // The next message of two parts, a topic and its body; others are skipped.
  [[nodiscard]] bool receive(net::Message& topic, net::Message& body) {
    return socket_.receive(topic, body) == link::Received::kMessage;
  }
  // Waits for a message; returns false on timeout or a signal.
  [[nodiscard]] bool wait(std::chrono::milliseconds timeout);

  // Why the daemon refuses this client, in one sentence, once that is known. Call from time to
  // time: it opens the socket anew, too.
  [[nodiscard]] std::optional<Error> refusal();
  // Whether the connection is established, as of the last call of refusal().
  [[nodiscard]] bool established() const { return socket_.established(); }
  // How many connections were ended here because the peer sent more than any daemon does.
  [[nodiscard]] std::uint64_t cuts() const { return cuts_; }
  [[nodiscard]] Error no_answer() const;  // the error if nothing answers at the endpoint
  // The sentence for a daemon that has answered before but has been silent for `silence_s`. `cut`:
  // its connection was ended here since then.
  [[nodiscard]] std::string silence(double silence_s, bool cut) const;

 private:
  Connection(net::Context context, link::DaemonSocket socket)
      : context_(std::move(context)), socket_(std::move(socket)) {}

  void open_anew();

  net::Context context_;
  link::DaemonSocket socket_;
  std::set<std::string> wanted_;  // prefixes of topics
  link::Retry retry_{};
  std::uint64_t cuts_ = 0;  // of all sockets so far
};

// Watches the daemon's heartbeat, its stats, and prints on stderr when it falls silent and when it
// is back.
class SilenceWatch {
 public:
  // `connection` outlives it. `timeout_s`: give up after this much silence; 0: never.
  SilenceWatch(const Connection& connection, double timeout_s);

  void beat();  // call for every message
  // Call from time to time: prints what is new. Returns an error when it is time to give up.
  [[nodiscard]] std::optional<Error> report();
  // The sentence to show while the daemon is silent; empty while it answers.
  [[nodiscard]] std::optional<std::string> silence() const;
  // Whether report() prints; a full-screen view shows silence() instead.
  void print(bool yes) { prints_ = yes; }

 private:
  // Without the endpoint, for a daemon that has answered before.
  [[nodiscard]] std::string sentence(double silence_s) const;

  const Connection& connection_;
  double timeout_s_;
  bool prints_ = true;
  std::uint64_t cuts_ = 0;  // of the connection, when the daemon answered last
  Heartbeat heart_;
};

// Adds --timeout: how long to wait for a daemon that does not answer; 0, the default: for ever.
void add_timeout_option(CLI::App& command, double& timeout_s);

// How often a waiting client checks keys, signals and refusals.
inline constexpr std::chrono::milliseconds kLookAround{100};

// While one exists, SIGINT and SIGTERM only set a flag. A reader of stdout that has gone (`posed
// monitor | head`) counts as an interrupt, too.
class Interrupt {
 public:
  Interrupt();
  [[nodiscard]] static bool came();
};

// Messages as canonical proto3 JSON (lowerCamelCase names, 64-bit integers as text). Every plain
// field is written even if it has its default, so that a script always finds it.
[[nodiscard]] std::string to_json(const google::protobuf::Message& message);

// Prints one line on stdout and flushes it. Returns false if the reader of stdout has gone.
bool print_json(const google::protobuf::Message& message);

}  // namespace posed::tools
