// Why a daemon does not admit a client, in words, for everything that connects to one. Cold.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/net/security.hpp"
#include "proto/zmq/link_monitor.hpp"

namespace posed::net {

// What follows "the daemon at ENDPOINT ..."; empty for Refusal::kNone. `domain`: what the client
// wanted; `server_key`: the NAME.pub that it was given.
[[nodiscard]] std::string refusal_words(Refusal refusal, Domain domain,
                                        const std::filesystem::path& server_key);

}  // namespace posed::net
