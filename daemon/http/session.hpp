// Session: one HTTP connection. It answers one request after the other as the service says, and
// ends when the other side is slow, or sends what it cannot read. It keeps itself alive until the
// connection has ended. Cold.
#pragma once

#include <list>
#include <memory>
#include <optional>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>

#include "daemon/http/exchange.hpp"
#include "daemon/http/service.hpp"

namespace posed::http {

// Returns the parts of a message that services use. They are valid as long as the message.
[[nodiscard]] Request parts_of(const Message& message);

class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(boost::asio::ip::tcp::socket socket, Connections& connections);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void read();
  // Removes the session from the connections at once.
  void close();

 private:
  using Parser = boost::beast::http::request_parser<boost::beast::http::empty_body>;
  void obey();
  void upgrade();
  void send(const Answer& answer);
  template <typename Body>
  void send_message(const Answer& answer, typename Body::value_type body);

  Connections& connections_;
  std::optional<std::list<Session*>::iterator> place_;  // empty once closed
  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<Parser> parser_;  // parses the request that is read or answered
};

}  // namespace posed::http
