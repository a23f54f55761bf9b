// Request and Answer: the parts of an HTTP request that posed uses, and its reply. They are plain
// values without a socket. Every part of a request is untrusted. Cold.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace posed::http {

// The parts of a request that matter. They are valid while it is answered.
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
  std::string_view etag{};              // empty: the browser must not cache the answer
  std::shared_ptr<const void> keeps{};  // owns the bytes of `body`; null: the service owns them
  // The request may become a WebSocket; status 101.
  [[nodiscard]] bool upgrades() const noexcept { return status == 101; }
};

[[nodiscard]] inline Answer refuse(unsigned status, std::string_view sentence) {
  return {.status = status, .body = sentence};
}

// Whether the text has the form of a Host header.
[[nodiscard]] bool is_host(std::string_view text);
// Whether it is one of the server's own `hosts` ("127.0.0.1:5580"). This stops web pages that make
// their own name point to this server (DNS rebinding). With empty `hosts` every host passes,
// because the server listens on all addresses.
[[nodiscard]] bool is_own_host(std::string_view host, const std::vector<std::string>& hosts);

}  // namespace posed::http
