// Service: answers the requests of an HTTP server. All calls come from the thread that runs the
// io_context. Cold.
#pragma once

#include <cstddef>
#include <list>
#include <string_view>
#include <vector>

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "daemon/http/exchange.hpp"

namespace posed::http {

using Message = boost::beast::http::request<boost::beast::http::empty_body>;

class Service {
 public:
  Service() = default;
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  virtual ~Service() = default;

  [[nodiscard]] virtual Answer answer(const Request& request) = 0;
  // Returns headers for every answer but that with status 101; of one name they replace the
  // answer's own. `host` is what the request says, untrusted.
  [[nodiscard]] virtual std::vector<Header> headers(std::string_view host) const {
    static_cast<void>(host);
    return {{"X-Content-Type-Options", "nosniff"}};
  }
  // Called in place of sending an answer with status 101: takes the connection and must send the
  // handshake itself. A client that has sent bytes beyond its request is closed without this call.
  virtual void upgrade(boost::beast::tcp_stream stream, const Message& request) {
    static_cast<void>(request);
    stream.close();
  }
  // Counts the open connections that were upgraded; they count towards kMaxConnections.
  [[nodiscard]] virtual std::size_t upgraded() const { return 0; }
};

class Session;

// The service and its open connections, the oldest first. It outlives them and the io_context.
struct Connections {
  Service& service;
  std::list<Session*> sessions{};
};

}  // namespace posed::http
