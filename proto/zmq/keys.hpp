// CURVE key files: NAME.key holds the secret key, NAME.pub the public key, each as 40 characters of
// Z85 (ZeroMQ RFC 32) and a newline. The public key can be computed from the secret one.
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

// Makes a key pair and writes DIR/NAME.pub and DIR/NAME.key (mode 0600). Refuses to overwrite
// either file, and leaves neither behind when one cannot be written.
Result<KeyPair> write_new_keys(const std::string& name, const std::filesystem::path& folder);

// Reads NAME.key. Refuses a file that other users can read, because its key is no longer secret.
Result<KeyPair> read_secret_key(const std::filesystem::path& path);

// Reads NAME.pub; returns the key in Z85.
Result<std::string> read_public_key(const std::filesystem::path& path);

// Whether `text` has the form of a key: 40 characters of Z85.
[[nodiscard]] bool is_key(const std::string& text);

// Makes `socket` a CURVE client with its own NAME.key and the server's NAME.pub. Call before
// connect.
Result<> secure_client(void* socket, const std::filesystem::path& key_file,
                       const std::filesystem::path& server_key_file);

}  // namespace posed::net
