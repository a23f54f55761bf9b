// Bytes from and for a device, as the tests write them.
#pragma once

#include <cstddef>
#include <ios>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace posed::test {

inline std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// "01 3f": two bytes.
inline std::vector<std::byte> bytes_of_hex(const std::string& digits) {
  std::vector<std::byte> bytes;
  std::istringstream words(digits);
  for (unsigned value = 0; words >> std::hex >> value;) {
    bytes.push_back(static_cast<std::byte>(value));
  }
  return bytes;
}

}  // namespace posed::test
