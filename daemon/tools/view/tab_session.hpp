// TabSession: the WebSocket of one open page. It sends what the tab's outbox gives, one message at
// a time, and reads the page's messages while their answers have room. It keeps itself alive until
// the connection has ended. Cold.
#pragma once

#include <cstdint>
#include <list>
#include <memory>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "daemon/http/service.hpp"
#include "daemon/tools/view/hub.hpp"
#include "daemon/tools/view/web_room.hpp"

namespace posed::view {

class TabSession : public std::enable_shared_from_this<TabSession> {
 public:
  // The connection of a request that the rules let become a WebSocket. `room` outlives it.
  TabSession(boost::beast::tcp_stream stream, WebRoom& room);
  ~TabSession();
  TabSession(const TabSession&) = delete;
  TabSession& operator=(const TabSession&) = delete;

  void start(const http::Message& request);
  // Ends the connection if the page has taken nothing for too long.
  void check(std::int64_t now_ns);

 private:
  void read();
  void send();
  void close();

  WebRoom& room_;
  std::list<TabSession*>::iterator place_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::beast::flat_buffer buffer_;
  Tab tab_;
  Parcel sending_;               // its bytes stay until they are sent
  std::int64_t sending_ns_ = 0;  // since when
  bool open_ = false, reading_ = false, is_sending_ = false;
};

}  // namespace posed::view
