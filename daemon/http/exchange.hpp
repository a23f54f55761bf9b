// Request and Answer: what a small HTTP server of posed looks at, and what it says. Each part of a
// request is untrusted. No socket; plain values. Cold.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace posed::http {

// The parts of a request that matter; valid while it is answered.
struct Request {
  std::string_view method{}, target{}, host{}, origin{}, if_none_match{};
  bool upgrade = false;  // to a WebSocket
};

// A header of an answer.
struct Header {
  std::string_view name;
  std::string value;
};

struct Answer {
  unsigned status = 200;
  std::string_view body{};
  std::string_view type = "text/plain; charset=utf-8";
  std::string_view etag{};              // empty: not to be kept by the browser
  std::shared_ptr<const void> keeps{};  // owns what `body` shows; null: the service does
  // The request may become a WebSocket; status 101.
  [[nodiscard]] bool upgrades() const noexcept { return status == 101; }
};

[[nodiscard]] inline Answer refuse(unsigned status, std::string_view sentence) {
  return {.status = status, .body = sentence};
}

// Whether the Host header could be one at all.
[[nodiscard]] bool is_host(std::string_view text);
// Whether it is one of the server's own `hosts` ("127.0.0.1:5580"), against web pages that make
// their own name point here. Empty `hosts`: any, because the server listens on all addresses.
[[nodiscard]] bool is_own_host(std::string_view host, const std::vector<std::string>& hosts);

}  // namespace posed::http
