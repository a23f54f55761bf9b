// What the bridge answers to an HTTP request: who gets the page, who may open the WebSocket, and
// what is refused. No socket; pure functions, so that tests and a fuzz target can try every
// request. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/http/exchange.hpp"
#include "daemon/tools/view/page_files.hpp"

namespace posed::view {

// What is served, and to whom.
struct Site {
  PageFiles files{};
  std::string token{};  // whoever knows it may see the streams
  // Of the page's own addresses (http::is_own_host).
  std::vector<std::string> hosts{};
};

[[nodiscard]] http::Answer answer_to(const http::Request& request, const Site& site);

// Headers of every answer: they forbid the browser to run, load, send or frame anything but the
// page itself.
[[nodiscard]] std::vector<http::Header> safety_headers(std::string_view host);

// 128 random bits as 22 characters for a URL.
[[nodiscard]] std::string random_token();

}  // namespace posed::view
