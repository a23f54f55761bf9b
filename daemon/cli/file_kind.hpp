// What a file is, by its first bytes, so that a command that is given the wrong one can say which
// command wants it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::cli {

enum class FileKind : std::uint8_t {
  kModel,        // M.style or H.gesture
  kCalibration,  // TOML with a [sensors] table
  kConfig,       // TOML with [[stream]] tables
  kClip,         // BVH, ASF, AMC or a hand's CSV
  kDeviceLog,
  kKey,    // of CURVE, secret or public
  kOther,  // none of these
};

// Of a file that begins with `bytes` (a few KB are enough).
[[nodiscard]] FileKind kind_of(std::string_view bytes);

// An Error that says what the file is and which command wants it for `stream`, when it is of
// another kind. Silent when its kind is not known or it cannot be read: whoever reads it whole says
// why.
[[nodiscard]] Result<> expect_kind(const std::filesystem::path& path, FileKind wanted,
                                   std::string_view stream);

}  // namespace posed::cli
