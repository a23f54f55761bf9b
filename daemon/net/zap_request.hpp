// What libzmq asks a ZAP handler (ZeroMQ RFC 27), read from the parts of its message.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "daemon/net/security.hpp"

namespace posed::net {

struct ZapRequest {
  std::string id;                // goes back with the answer
  std::string mechanism;         // "NULL", "CURVE", ...
  std::string key_z85;           // the client's public key; empty without CURVE
  std::optional<Domain> domain;  // which socket of ours; none of them when empty
};

// Nothing when the parts are no request of version 1.0.
[[nodiscard]] std::optional<ZapRequest> read_zap_request(std::span<const std::string> parts);

}  // namespace posed::net
