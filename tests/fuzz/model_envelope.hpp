// Wraps any bytes as the payload of a model file with a valid header, so that a fuzz target gets
// past the checksum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <zlib.h>

namespace posed::fuzz {

template <typename T>
void put(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<char>((value >> (8 * i)) & 0xFF));
  }
}

inline std::string as_model_file(const std::string& payload) {
  std::string out = "POSEDMDL";
  put<std::uint32_t>(out, 1);
  put<std::uint64_t>(out, payload.size());
  put<std::uint32_t>(out, static_cast<std::uint32_t>(crc32_z(
                              0, reinterpret_cast<const Bytef*>(payload.data()), payload.size())));
  return out + payload;
}

}  // namespace posed::fuzz
