// What all commands that talk to a running daemon share: their options, a connection that can say
// why it does not come about, and Ctrl-C.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/cli/live/heartbeat.hpp"
#include "daemon/net/security.hpp"
#include "daemon/net/zmq_handle.hpp"
#include "proto/frame/result.hpp"

namespace CLI {
class App;
}

namespace posed::cli {

struct ClientOptions {
  std::string endpoint;
  std::filesystem::path key;         // own NAME.key; empty: no CURVE
  std::filesystem::path server_key;  // the daemon's NAME.pub
};

// --connect (default `endpoint`), --key and --server-key.
void add_client_options(CLI::App& command, ClientOptions& options, const char* endpoint);

// A connected socket that watches its own connection.
class Connection {
 public:
  // `type` is ZMQ_SUB or ZMQ_DEALER. Returns at once; the connection comes about behind it, again
  // and again if need be.
  [[nodiscard]] static Result<Connection> open(const ClientOptions& options, int type);

  [[nodiscard]] const std::string& endpoint() const { return options_.endpoint; }
  [[nodiscard]] void* socket() const { return socket_.get(); }
  // Waits for a message; false on timeout or a signal.
  [[nodiscard]] bool wait(std::chrono::milliseconds timeout);

  // Why the daemon does not let us in, once that is known: one sentence. Call now and then.
  [[nodiscard]] std::optional<Error> refusal();
  // Whether the connection stands, as far as refusal() has seen.
  [[nodiscard]] bool established() const { return established_; }
  [[nodiscard]] Error no_answer() const;  // the sentence for nobody being there
  // The same for a daemon that has answered before, and not for so long.
  [[nodiscard]] std::string silence(double silence_s) const;

 private:
  Connection(ClientOptions options, net::Domain domain, net::Context context, net::Socket socket,
             net::Socket monitor);
  [[nodiscard]] Error wants_key() const;

  ClientOptions options_;
  net::Domain domain_;
  net::Context context_;
  net::Socket socket_;
  net::Socket monitor_;
  bool established_ = false;
  int hang_ups_ = 0;  // in a row, before the handshake
};

// Listens for the daemon's heartbeat, its stats, and says on stderr when it falls silent and when
// it is back.
class SilenceWatch {
 public:
  // `connection` outlives it. `timeout_s`: silence after which to give up; 0: never.
  SilenceWatch(const Connection& connection, double timeout_s);

  void heard();  // any message
  // Call now and then: says what is new. The error when it is time to give up.
  [[nodiscard]] std::optional<Error> report();
  // The sentence to show while the daemon is silent; nothing while it answers.
  [[nodiscard]] std::optional<std::string> silence() const;
  // Whether report() prints; a drawn screen shows silence() instead.
  void print(bool yes) { prints_ = yes; }

 private:
  [[nodiscard]] std::string sentence(double silence_s) const;

  const Connection& connection_;
  double timeout_s_;
  bool prints_ = true;
  Heartbeat heart_;
};

// --timeout: how long to wait for a daemon that does not answer; 0, the default, for ever.
void add_timeout_option(CLI::App& command, double& timeout_s);

// How long a client waits before it looks for keys, signals and refusals.
inline constexpr std::chrono::milliseconds kLookAround{100};

// From its making on SIGINT and SIGTERM only set a flag. A stdout that nobody reads any more
// (`posed monitor | head`) is as good a reason to end.
class Interrupt {
 public:
  Interrupt();
  [[nodiscard]] static bool came();
};

}  // namespace posed::cli
