// CURVE keys as posed keeps them: NAME.key holds the secret half, NAME.pub the public one, each as
// 40 characters of Z85 (ZeroMQ RFC 32) and a newline. The public half follows from the secret one.
#pragma once

#include <filesystem>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::net {

inline constexpr std::size_t kKeyLength = 40;  // characters

struct KeyPair {
  std::string public_z85;
  std::string secret_z85;
};

// Makes a pair and writes DIR/NAME.pub and DIR/NAME.key (mode 0600). Refuses to overwrite either,
// and leaves no half pair behind.
[[nodiscard]] Result<KeyPair> write_new_keys(const std::string& name,
                                             const std::filesystem::path& folder);

// A NAME.key. Refuses one that others can read: it is a secret no longer.
[[nodiscard]] Result<KeyPair> read_secret_key(const std::filesystem::path& path);

// A NAME.pub, in Z85.
[[nodiscard]] Result<std::string> read_public_key(const std::filesystem::path& path);

// Whether `text` could be a key at all: 40 characters of Z85.
[[nodiscard]] bool is_key(const std::string& text);

}  // namespace posed::net
