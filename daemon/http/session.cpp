#include "daemon/http/session.hpp"

#include <chrono>
#include <cstdint>
#include <string_view>
#include <utility>

#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

namespace posed::http {
namespace {

namespace beast = boost::beast;
namespace protocol = beast::http;
using namespace std::chrono_literals;

constexpr std::uint32_t kMaxHeader = 8 * 1024;  // bytes
constexpr auto kRequestWithin = 10s;            // also until the next one
constexpr auto kAnswerWithin = 30s;             // a slow reader of a large file

std::string_view text(beast::string_view part) { return {part.data(), part.size()}; }

}  // namespace

Request parts_of(const Message& message) {
  return {.method = text(message.method_string()),
          .target = text(message.target()),
          .host = text(message[protocol::field::host]),
          .origin = text(message[protocol::field::origin]),
          .if_none_match = text(message[protocol::field::if_none_match]),
          .upgrade = beast::websocket::is_upgrade(message)};
}

Session::Session(boost::asio::ip::tcp::socket socket, Connections& connections)
    : connections_(connections),
      place_(connections.sessions.insert(connections.sessions.end(), this)),
      stream_(std::move(socket)),
      buffer_(2 * kMaxHeader) {}

Session::~Session() { close(); }

void Session::close() {
  if (place_) connections_.sessions.erase(*place_);
  place_.reset();
  stream_.close();
}

void Session::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  stream_.expires_after(kRequestWithin);
  protocol::async_read_header(
      stream_, buffer_, *parser_,
      [self = shared_from_this()](const beast::error_code& error, std::size_t) {
        if (error) return self->close();
        self->obey();
      });
}

void Session::obey() {
  const Answer answer = connections_.service.answer(parts_of(parser_->get()));
  if (!answer.upgrades()) return send(answer);
  upgrade();
}

void Session::upgrade() {
  // A browser sends nothing before the answer to its handshake.
  if (buffer_.size() > 0) return close();
  stream_.expires_never();  // what the connection becomes has limits of its own
  connections_.service.upgrade(std::move(stream_), parser_->get());
}

void Session::send(const Answer& answer) {
  const bool bare = parser_->get().method() == protocol::verb::head || answer.status == 304;
  if (bare) return send_message<protocol::empty_body>(answer, {});
  send_message<protocol::span_body<const char>>(answer, {answer.body.data(), answer.body.size()});
}

template <typename Body>
void Session::send_message(const Answer& answer, typename Body::value_type body) {
  const auto& request = parser_->get();
  auto message = std::make_shared<protocol::response<Body>>();
  message->version(request.version());
  message->result(answer.status);
  message->body() = body;
  message->content_length(answer.body.size());
  message->set(protocol::field::content_type,
               beast::string_view(answer.type.data(), answer.type.size()));
  const auto set = [&](beast::string_view name, std::string_view value) {
    message->set(name, beast::string_view(value.data(), value.size()));
  };
  set("Cache-Control", answer.etag.empty() ? "no-store" : "no-cache");
  if (!answer.etag.empty()) set("ETag", answer.etag);
  if (answer.status == 405) set("Allow", "GET, HEAD");
  for (const Header& header : connections_.service.headers(text(request[protocol::field::host]))) {
    set(beast::string_view(header.name.data(), header.name.size()), header.value);
  }
  // A body is never read, so nothing can follow one.
  const bool has_body = request.has_content_length() || request.chunked();
  message->keep_alive(request.keep_alive() && !has_body && answer.status < 400);
  stream_.expires_after(kAnswerWithin);
  protocol::async_write(stream_, *message,
                        [self = shared_from_this(), message, keeps = answer.keeps](
                            const beast::error_code& error, std::size_t) {
                          if (error || !message->keep_alive()) return self->close();
                          self->read();
                        });
}

}  // namespace posed::http
