// WebSession: one HTTP connection that is no WebSocket yet. It answers one request after the other
// by the rules and ends when the other side is slow, or sends what it cannot read. It keeps itself
// alive until the connection has ended. Cold.
#pragma once

#include <list>
#include <memory>
#include <optional>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>

#include "daemon/view/web_server.hpp"

namespace posed::view {

// What the rules look at; valid as long as the message.
[[nodiscard]] WebRequest parts_of(
    const boost::beast::http::request<boost::beast::http::empty_body>& message);

class WebSession : public std::enable_shared_from_this<WebSession> {
 public:
  // `room` outlives it.
  WebSession(boost::asio::ip::tcp::socket socket, WebRoom& room);
  ~WebSession();
  WebSession(const WebSession&) = delete;
  WebSession& operator=(const WebSession&) = delete;

  void read();
  // Its place in the room is free at once.
  void close();

 private:
  using Parser = boost::beast::http::request_parser<boost::beast::http::empty_body>;
  void obey();
  void upgrade();
  void send(const WebAnswer& answer);
  template <typename Body>
  void send_message(const WebAnswer& answer, typename Body::value_type body);

  WebRoom& room_;
  std::optional<std::list<WebSession*>::iterator> place_;  // empty once closed
  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<Parser> parser_;  // of the request that is read or answered
};

}  // namespace posed::view
