// Uploads: models that arrive in pieces. One at a time per client, few at once, bounded in bytes
// and in time; a model comes out only when it is whole and its SHA-256 is what the client said. No
// socket, no clock of its own, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::control {

inline constexpr std::size_t kMaxModel = 16 * 1024 * 1024;  // bytes, of all uploads together, too
inline constexpr std::size_t kMaxPiece = 32 * 1024;         // bytes
inline constexpr std::size_t kMaxUploads = 4;               // at once
inline constexpr double kUploadPause_s = 10.0;  // a client that sends no piece for so long has left

// One piece as a client sent it (posed.v1.ControlRequest.ModelPart).
struct ModelPiece {
  std::string_view stream, sha256;
  std::uint64_t total = 0;
  std::uint64_t offset = 0;
  std::string_view bytes;
};

class Uploads {
 public:
  // Takes a piece of `client`'s. The model's bytes when this was the last one; nullopt when more
  // are to come. An error ends the client's upload. Offset 0 begins one anew.
  [[nodiscard]] Result<std::optional<std::string>> take(const std::string& client,
                                                        const ModelPiece& piece,
                                                        std::int64_t now_ns);
  // Forgets those that go on no more. Returns when to look again; forever when none is under way.
  [[nodiscard]] std::int64_t forget_old(std::int64_t now_ns);
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  struct Upload {
    std::string stream, sha256, bytes;
    std::uint64_t total = 0;
    std::int64_t last_ns = 0;
  };
  using Iterator = std::map<std::string, Upload>::iterator;
  [[nodiscard]] Result<Iterator> find_or_begin(const std::string& client, const ModelPiece& piece);
  void erase(Iterator upload);

  std::map<std::string, Upload> uploads_;  // by client
  std::size_t bytes_ = 0;                  // of all
};

}  // namespace posed::control
