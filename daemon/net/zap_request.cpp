#include "daemon/net/zap_request.hpp"

#include <array>

#include <zmq.h>

namespace posed::net {
namespace {

constexpr std::size_t kKey = 32;  // bytes of a CURVE key

std::optional<Domain> domain_of(std::string_view name) {
  for (const Domain domain : {Domain::kPublish, Domain::kControl}) {
    if (name == domain_name(domain)) return domain;
  }
  return std::nullopt;
}

std::string to_z85(const std::string& key) {
  std::array<char, 41> z85{};
  const auto* raw = reinterpret_cast<const std::uint8_t*>(key.data());
  return zmq_z85_encode(z85.data(), raw, kKey) == nullptr ? std::string() : std::string(z85.data());
}

}  // namespace

// version, request id, domain, address, routing id, mechanism, credentials...
std::optional<ZapRequest> read_zap_request(std::span<const std::string> parts) {
  if (parts.size() < 6 || parts[0] != "1.0") return std::nullopt;
  ZapRequest request{
      .id = parts[1], .mechanism = parts[5], .key_z85 = {}, .domain = domain_of(parts[2])};
  if (request.mechanism == "CURVE" && parts.size() == 7 && parts[6].size() == kKey) {
    request.key_z85 = to_z85(parts[6]);
  }
  return request;
}

}  // namespace posed::net
