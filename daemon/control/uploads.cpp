#include "daemon/control/uploads.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frame/time.hpp"
#include "proto/log/digest.hpp"

namespace posed::control {
namespace {

constexpr std::size_t kSha256 = 64;  // hexadecimal digits

// Checks what does not depend on earlier pieces.
Result<> check_piece(const ModelPiece& piece) {
  if (piece.total == 0 || piece.total > kMaxModel) {
    return fail(fmt::format("a model file has 1 to {} bytes, not {}", kMaxModel, piece.total));
  }
  if (piece.bytes.empty() || piece.bytes.size() > kMaxPiece) {
    return fail(
        fmt::format("a piece of a model has 1 to {} bytes, not {}", kMaxPiece, piece.bytes.size()));
  }
  if (piece.sha256.size() != kSha256) {
    return fail("the model's sha256 is missing: give it as 64 hexadecimal digits in every piece");
  }
  return {};
}

}  // namespace

Result<Uploads::Iterator> Uploads::find_or_begin(const std::string& client,
                                                 const ModelPiece& piece) {
  auto found = uploads_.find(client);
  if (piece.offset != 0) {
    if (found != uploads_.end()) return found;
    return fail("no upload is under way here: it took too long, or did not begin at offset 0");
  }
  if (found != uploads_.end()) erase(found);
  if (uploads_.size() >= kMaxUploads) {
    return fail("others are sending models; try again in some seconds");
  }
  return uploads_
      .emplace(client, Upload{.stream = std::string(piece.stream),
                              .sha256 = std::string(piece.sha256),
                              .bytes = {},
                              .total = piece.total})
      .first;
}

Result<std::optional<std::string>> Uploads::add(const std::string& client, const ModelPiece& piece,
                                                std::int64_t now_ns) {
  (void)forget_old(now_ns);
  TRY(check_piece(piece));
  auto found = TRY(find_or_begin(client, piece));
  Upload& upload = found->second;
  if (piece.offset != upload.bytes.size() || piece.total != upload.total ||
      piece.sha256 != upload.sha256 || piece.stream != upload.stream ||
      piece.bytes.size() > upload.total - upload.bytes.size()) {
    erase(found);
    return fail("this piece does not continue the one before; send the model again from offset 0");
  }
  if (bytes_ + piece.bytes.size() > kMaxModel) {
    erase(found);
    return fail("others are sending models; try again in some seconds");
  }
  upload.bytes += piece.bytes;
  upload.last_ns = now_ns;
  bytes_ += piece.bytes.size();
  if (upload.bytes.size() < upload.total) return std::nullopt;
  bytes_ -= upload.bytes.size();
  Upload whole = std::move(upload);
  uploads_.erase(found);
  if (log::sha256_hex(std::as_bytes(std::span(whole.bytes))) != whole.sha256) {
    return fail("the model arrived damaged: its sha256 is different; send it again");
  }
  return std::optional(std::move(whole.bytes));
}

std::int64_t Uploads::forget_old(std::int64_t now_ns) {
  std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
  for (auto it = uploads_.begin(); it != uploads_.end();) {
    const auto upload = it++;
    const std::int64_t until_ns = upload->second.last_ns + nanoseconds(kUploadPause_s);
    if (now_ns >= until_ns) {
      erase(upload);
    } else {
      next_ns = std::min(next_ns, until_ns);
    }
  }
  return next_ns;
}

void Uploads::erase(Iterator upload) {
  bytes_ -= upload->second.bytes.size();
  uploads_.erase(upload);
}

}  // namespace posed::control
