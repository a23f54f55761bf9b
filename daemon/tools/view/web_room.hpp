// WebRoom: what `posed view` serves over HTTP: the page by its rules (request_rules), and a tab of
// the Hub for each WebSocket. One thread: the one that runs the io_context. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/beast/core/tcp_stream.hpp>

#include "daemon/http/exchange.hpp"
#include "daemon/http/service.hpp"
#include "daemon/tools/view/hub.hpp"
#include "daemon/tools/view/request_rules.hpp"

namespace posed::view {

inline constexpr std::size_t kMaxTabs = 32;  // of http::kMaxConnections

class TabSession;

class WebRoom final : public http::Service {
 public:
  // `of_hub` outlives the room; the room outlives the connections and the io_context.
  WebRoom(Site of_site, Hub& of_hub) : site(std::move(of_site)), hub(of_hub) {}

  [[nodiscard]] http::Answer answer(const http::Request& request) override;
  [[nodiscard]] std::vector<http::Header> headers(std::string_view host) const override {
    return safety_headers(host);
  }
  void upgrade(boost::beast::tcp_stream stream, const http::Message& request) override;
  [[nodiscard]] std::size_t upgraded() const override { return tabs.size(); }
  // Ends tabs that have taken nothing for too long. Call some times a second.
  void turn(std::int64_t now_ns);

  Site site;
  Hub& hub;
  std::list<TabSession*> tabs{};
};

}  // namespace posed::view
