// What the bridge answers to an HTTP request: who gets the page, who may open the WebSocket, and
// what is refused. No socket; pure functions, so that tests and a fuzz target can try every
// request. Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "daemon/view/page_files.hpp"

namespace posed::view {

// The parts of an HTTP request that matter; each is untrusted.
struct WebRequest {
  std::string_view method{}, target{}, host{}, origin{}, if_none_match{};
  bool upgrade = false;  // to a WebSocket
};

// What is served, and to whom.
struct Site {
  PageFiles files{};
  std::string token{};  // whoever knows it may see the streams
  // The Host header of the page's own addresses ("127.0.0.1:5580"), against web pages that make
  // their own name point here. Empty: any, because the bridge listens on all addresses.
  std::vector<std::string> hosts{};
};

struct WebAnswer {
  unsigned status = 200;
  std::string_view body{};  // valid as long as the site
  std::string_view type = "text/plain; charset=utf-8";
  std::string_view etag{};  // empty: not to be kept by the browser
  // The request may become a WebSocket; status 101.
  [[nodiscard]] bool upgrades() const noexcept { return status == 101; }
};

[[nodiscard]] WebAnswer answer_to(const WebRequest& request, const Site& site);

// A header that every answer has.
struct WebHeader {
  std::string_view name;
  std::string value;
};
// They forbid the browser to run, load, send or frame anything but the page itself.
[[nodiscard]] std::vector<WebHeader> safety_headers(std::string_view host);

// 128 random bits as 22 characters for a URL.
[[nodiscard]] std::string random_token();

}  // namespace posed::view
