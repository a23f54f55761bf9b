// What all commands that talk to a running daemon share: their options, a connection that can say
// why it does not come about, and Ctrl-C.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/control/security.hpp"
#include "daemon/control/zmq_handle.hpp"
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

  [[nodiscard]] void* socket() const { return socket_.get(); }
  // Waits for a message; false on timeout or a signal.
  [[nodiscard]] bool wait(std::chrono::milliseconds timeout);

  // Why the daemon does not let us in, once that is known: one sentence. Call now and then.
  [[nodiscard]] std::optional<Error> refusal();
  // Whether the connection stands, as far as refusal() has seen.
  [[nodiscard]] bool established() const { return established_; }
  [[nodiscard]] Error no_answer() const;  // the sentence for nobody being there

 private:
  Connection(ClientOptions options, control::Domain domain, control::Context context,
             control::Socket socket, control::Socket monitor);
  [[nodiscard]] Error wants_key() const;

  ClientOptions options_;
  control::Domain domain_;
  control::Context context_;
  control::Socket socket_;
  control::Socket monitor_;
  bool established_ = false;
  int hang_ups_ = 0;  // in a row, before the handshake
};

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
