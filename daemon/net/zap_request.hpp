// A request of libzmq to its ZAP handler (ZeroMQ RFC 27), read from the parts of its message.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "daemon/net/security.hpp"

namespace posed::net {

struct ZapRequest {
  std::string id;                // returned in the reply
  std::string mechanism;         // "NULL", "CURVE", ...
  std::string key_z85;           // the client's public key; empty without CURVE or if it is no key
  std::optional<Domain> domain;  // of the socket it is for; empty: of no socket of ours
};

// Parses the parts; empty if they are not a request of version 1.0.
[[nodiscard]] std::optional<ZapRequest> read_zap_request(std::span<const std::string> parts);

}  // namespace posed::net
