#include "daemon/devices/body_names.hpp"

#include <algorithm>

#include "proto/text/stream_name.hpp"

namespace posed::devices {
namespace {

constexpr std::size_t kMaxName = kMaxStreamName - kRawSuffix.size();

char plain(char c) {
  if (c >= 'A' && c <= 'Z') return static_cast<char>(c - 'A' + 'a');
  const bool allowed = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  return allowed ? c : '-';
}

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

}  // namespace

std::string plain_stream_name(const std::string& source, const std::string& body) {
  std::string name = source;
  name += "-";
  name += body;
  std::erase_if(name, continues_character);  // of UTF-8: one '-' for each character
  std::ranges::transform(name, name.begin(), plain);
  return name.substr(0, kMaxName);
}

const std::string* BodyNames::name_of(const std::string& source, const std::string& body,
                                      int number) {
  const Body key{source, body, number};
  const auto known = names_.find(key);
  if (known != names_.end()) return &known->second;
  if (kept_[source] >= kMaxKept) return nullptr;
  ++kept_[source];
  const std::string plain = plain_stream_name(source, body);
  std::string name = plain;
  const auto taken = [this](const std::string& one) {
    return taken_.contains(one) || taken_.contains(raw_name(one));
  };
  for (int i = 2; taken(name); ++i) {
    const std::string suffix = "-" + std::to_string(i);
    name = plain.substr(0, kMaxName - suffix.size()) + suffix;
  }
  taken_.insert(name);
  taken_.insert(raw_name(name));
  return &names_.emplace(key, std::move(name)).first->second;
}

}  // namespace posed::devices
