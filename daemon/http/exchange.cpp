#include "daemon/http/exchange.hpp"

#include <algorithm>
#include <cstddef>

namespace posed::http {
namespace {

constexpr std::size_t kMaxHostBytes = 262;  // a DNS name and a port

}  // namespace

bool is_host(std::string_view text) {
  const auto fits = [](char sign) {
    return (sign >= 'a' && sign <= 'z') || (sign >= 'A' && sign <= 'Z') ||
           (sign >= '0' && sign <= '9') || std::string_view("-.:[]").contains(sign);
  };
  return !text.empty() && text.size() <= kMaxHostBytes && std::ranges::all_of(text, fits);
}

bool is_own_host(std::string_view host, const std::vector<std::string>& hosts) {
  if (!is_host(host)) return false;
  return hosts.empty() || std::ranges::find(hosts, host) != hosts.end();
}

}  // namespace posed::http
