// The key under which a log stores a file's bytes: their SHA-256 in lower-case hex.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace posed::log {

[[nodiscard]] std::string sha256_hex(std::span<const std::byte> bytes);

}  // namespace posed::log
