// Recognises what a file is by its first bytes, so that a command that gets the wrong file can name
// the command that reads it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::tools {

enum class FileKind : std::uint8_t {
  kModel,        // M.style or H.gesture
  kCalibration,  // TOML with a driver and a [sensors] table
  kConfig,       // TOML with [[stream]] or [[source]] tables
  kClip,         // of any format of proto/clip/format.hpp, or an AMC's skeleton
  kDeviceLog,
  kKey,    // CURVE key, secret or public
  kOther,  // none of these
};

// The kind of a file that begins with `bytes` (64 KB are enough; a key is known by its whole text).
[[nodiscard]] FileKind kind_of(std::string_view bytes);

// An error if the file is of another kind than `wanted`; it says what the file is and which command
// reads it, with the stream's name where that command takes one. No error if its kind is unknown or
// it cannot be read: then the code that reads the whole file reports it.
Result<> expect_kind(const std::filesystem::path& path, FileKind wanted, std::string_view stream);

}  // namespace posed::tools
