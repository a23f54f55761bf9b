#include "daemon/net/security.hpp"

#include <algorithm>

#include "proto/text/clean.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::net {
namespace {

// zmq.h declares the name only in its draft API, but stable 4.3.4 accepts the number.
constexpr int kZapEnforceDomain = 93;

// a peer that has not finished its handshake by then is dropped
constexpr int kHandshake_ms = 3000;

bool has_right(const AllowedClient& client, Domain domain) {
  return domain == Domain::kPublish ? client.may_subscribe : client.may_control;
}

// "127.0.0.1" or another address of that network, written as four numbers; "127.evil.example" is
// not a loopback address but an ordinary host name.
bool is_loopback_address(std::string_view host) {
  return host.starts_with("127.") &&
         host.find_first_not_of("0123456789.") == std::string_view::npos;
}

}  // namespace

std::string_view domain_name(Domain domain) {
  return domain == Domain::kPublish ? "posed.publish" : "posed.control";
}

const AllowedClient* AccessList::find(std::string_view public_z85, Domain domain) const {
  const auto found = std::ranges::find_if(clients_, [&](const AllowedClient& client) {
    return client.public_z85 == public_z85 && has_right(client, domain);
  });
  return found == clients_.end() ? nullptr : &*found;
}

bool AccessList::revokes_any(const AccessList& newer, Domain domain) const {
  return std::ranges::any_of(clients_, [&](const AllowedClient& client) {
    return has_right(client, domain) && newer.find(client.public_z85, domain) == nullptr;
  });
}

// Without a key only the domain is set. The ZapAuthenticator is asked all the same, and a socket
// with a domain refuses ZMTP before 3.0. (Otherwise libzmq 4.3.4 would read the body of a web
// page's HTTP POST as messages of the unversioned ZMTP 1.0.)
Result<> secure_server(void* socket, Domain domain, const std::string& secret_z85) {
  for (const Result<>& set : {set_option(socket, ZMQ_ZAP_DOMAIN, domain_name(domain)),
                              set_option(socket, kZapEnforceDomain, 1),
                              set_option(socket, ZMQ_HANDSHAKE_IVL, kHandshake_ms)}) {
    if (!set) return set;
  }
  if (secret_z85.empty()) return {};
  TRY(set_option(socket, ZMQ_CURVE_SERVER, 1));
  return set_option(socket, ZMQ_CURVE_SECRETKEY, secret_z85);
}

bool is_loopback(std::string_view endpoint) {
  if (endpoint.starts_with("ipc://") || endpoint.starts_with("inproc://")) return true;
  constexpr std::string_view kTcp = "tcp://";
  if (!endpoint.starts_with(kTcp)) return false;
  const std::string_view address = endpoint.substr(kTcp.size());
  const std::string_view host = address.substr(0, address.rfind(':'));
  return host == "localhost" || host == "[::1]" || is_loopback_address(host);
}

std::string open_to_anyone(std::string_view endpoint) {
  return clean_name(endpoint) + " can be reached from other machines by anyone";
}

}  // namespace posed::net
