#include "daemon/tools/view/tab_session.hpp"

#include <chrono>
#include <string_view>
#include <utility>

#include <boost/asio/buffer.hpp>

#include "daemon/system/clock.hpp"
#include "proto/frame/time.hpp"

namespace posed::view {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using namespace std::chrono_literals;

constexpr std::int64_t kSendWithin_ns = 30 * kNanosPerSecond;

}  // namespace

TabSession::TabSession(beast::tcp_stream stream, WebRoom& room)
    : room_(room),
      place_(room.tabs.insert(room.tabs.end(), this)),
      socket_(std::move(stream)),
      buffer_(kMaxPageMessage) {
  tab_.wake = [this] { send(); };
}

TabSession::~TabSession() {
  if (open_) room_.hub.leave(tab_);
  room_.tabs.erase(place_);
}

void TabSession::start(const http::Message& request) {
  // A browser answers pings by itself, also while the page's script stands still.
  socket_.set_option(websocket::stream_base::timeout{
      .handshake_timeout = 10s, .idle_timeout = 30s, .keep_alive_pings = true});
  socket_.read_message_max(kMaxPageMessage);
  socket_.auto_fragment(false);
  socket_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
    if (error) return;
    self->open_ = true;
    self->room_.hub.join(self->tab_);
    self->read();
  });
}

void TabSession::read() {
  if (reading_ || !open_ || !tab_.outbox.has_room()) return;
  reading_ = true;
  socket_.async_read(
      buffer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
        self->reading_ = false;
        if (error) return self->close();
        const auto data = self->buffer_.cdata();
        const std::string_view bytes(static_cast<const char*>(data.data()), data.size());
        self->room_.hub.take(self->tab_, bytes, self->socket_.got_text(), system::monotonic_ns());
        self->buffer_.clear();
        self->read();
      });
}

void TabSession::send() {
  if (is_sending_ || !open_) return;
  auto parcel = tab_.outbox.next();
  if (!parcel) return;
  sending_ = std::move(*parcel);
  sending_ns_ = system::monotonic_ns();
  is_sending_ = true;
  socket_.text(sending_.text);
  socket_.async_write(boost::asio::buffer(*sending_.bytes),
                      [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                        self->is_sending_ = false;
                        self->sending_ = {};
                        if (error) return self->close();
                        self->send();
                        self->read();  // answers may have room again
                      });
}

void TabSession::check(std::int64_t now_ns) {
  if (is_sending_ && now_ns - sending_ns_ > kSendWithin_ns) close();
}

// Without a farewell: who does not read would not read it either.
void TabSession::close() {
  if (std::exchange(open_, false)) room_.hub.leave(tab_);
  beast::get_lowest_layer(socket_).close();
}

}  // namespace posed::view
