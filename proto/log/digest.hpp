// The SHA-256 of bytes in lower-case hex: the key under which a log stores a file, and by which two
// machines compare their files. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::log {

[[nodiscard]] std::string sha256_hex(std::span<const std::byte> bytes);

// Reads a file of any size piece by piece.
Result<std::string> sha256_of_file(const std::filesystem::path& path);

}  // namespace posed::log
