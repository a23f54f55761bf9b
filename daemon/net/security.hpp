// Access control: CURVE keys on the sockets, and an allow-list that gives rights to keys. Every
// secured socket names a ZAP domain and enforces it (without ZMQ_ZAP_ENFORCE_DOMAIN libzmq admits
// unknown clients while no handler runs).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::net {

// The purpose of a socket, and the right that a client needs to use it.
enum class Domain : std::uint8_t { kPublish, kControl };
[[nodiscard]] std::string_view domain_name(Domain domain);  // as it appears in ZAP requests

struct AllowedClient {
  std::string name;        // human-readable
  std::string public_z85;  // the content of its NAME.pub; also the connection's User-Id
  bool may_subscribe = true;
  bool may_control = false;
};

class AccessList {
 public:
  AccessList() = default;
  explicit AccessList(std::vector<AllowedClient> clients) : clients_(std::move(clients)) {}

  // The client with this public key if it has the right; null if it does not, or if the key is
  // unknown. Valid as long as the list.
  [[nodiscard]] const AllowedClient* find(std::string_view public_z85, Domain domain) const;
  // Whether `newer` revokes a right that some key has now; such clients must be disconnected.
  [[nodiscard]] bool revokes_any(const AccessList& newer, Domain domain) const;

 private:
  std::vector<AllowedClient> clients_;
};

// Makes `socket` a CURVE server of this domain; with an empty key it stays unencrypted, and only
// the authenticator decides who may connect. Call before bind. A ZapAuthenticator must be running
// in the same context, or every client is refused.
Result<> secure_server(void* socket, Domain domain, const std::string& secret_z85);

// Whether an endpoint that binds there can be reached from this machine only: tcp to 127.*, [::1]
// or localhost, ipc and inproc.
[[nodiscard]] bool is_loopback(std::string_view endpoint);

// The beginning of the sentence that refuses to listen beyond loopback without keys.
[[nodiscard]] std::string open_to_anyone(std::string_view endpoint);

}  // namespace posed::net
