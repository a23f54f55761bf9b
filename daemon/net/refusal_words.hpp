// Explains to a user why a daemon did not admit his client. Every program that connects uses it.
// Cold.
#pragma once

#include <filesystem>
#include <string>

#include "daemon/net/security.hpp"
#include "proto/zmq/link_monitor.hpp"

namespace posed::net {

// Returns the words that follow "the daemon at ENDPOINT ..."; empty for Refusal::kNone. `domain` is
// the socket that the client wanted, `server_key` the NAME.pub that it was given.
[[nodiscard]] std::string refusal_words(Refusal refusal, Domain domain,
                                        const std::filesystem::path& server_key);

}  // namespace posed::net
