// Uploads: models that arrive in pieces. Each client may have one upload at a time; their number,
// bytes and duration are limited. A model is returned only when it is complete and its SHA-256 is
// the one that the client stated. No socket, no clock of its own, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::control {

// Most bytes of a model, and of all uploads together.
inline constexpr std::size_t kMaxModel = 16 * 1024 * 1024;
inline constexpr std::size_t kMaxPiece = 32 * 1024;  // bytes
inline constexpr std::size_t kMaxUploads = 4;        // at once
// A client that sends no piece for this long is gone.
inline constexpr double kUploadPause_s = 10.0;

// One piece as the client sent it (posed.v1.ControlRequest.ModelPart).
struct ModelPiece {
  std::string_view stream, sha256;
  std::uint64_t total = 0;
  std::uint64_t offset = 0;
  std::string_view bytes;
};

class Uploads {
 public:
  // Adds a piece from `client`. Returns the model's bytes after the last piece, nullopt if more are
  // to come. A piece at offset 0 begins a new upload; one that does not continue it ends it, while
  // one that is invalid by itself (its size, no sha256) is only refused.
  Result<std::optional<std::string>> add(const std::string& client, const ModelPiece& piece,
                                         std::int64_t now_ns);
  // Forgets uploads that have stalled. Returns the latest time of the next call [ns]; the largest
  // one if no upload is under way.
  [[nodiscard]] std::int64_t forget_old(std::int64_t now_ns);
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  struct Upload {
    std::string stream, sha256, bytes;
    std::uint64_t total = 0;
    std::int64_t last_ns = 0;
  };
  using Iterator = std::map<std::string, Upload>::iterator;
  Result<Iterator> find_or_begin(const std::string& client, const ModelPiece& piece);
  void erase(Iterator upload);

  std::map<std::string, Upload> uploads_;  // by client
  std::size_t bytes_ = 0;                  // of all
};

}  // namespace posed::control
