#include "daemon/tools/command/file_kind.hpp"

#include <algorithm>
#include <fstream>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "proto/clip/format.hpp"
#include "proto/clip/text.hpp"

namespace posed::tools {
namespace {

using clip::has_line;

constexpr std::size_t kEnough = 64 * 1024;  // bytes
constexpr std::size_t kKeyLength = 40;      // characters of Z85

bool looks_like_key(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.remove_suffix(1);
  return text.size() == kKeyLength &&
         std::ranges::none_of(text, [](char c) { return c <= ' ' || c > '~'; });
}

const char* kind_name(FileKind kind) {
  switch (kind) {
    case FileKind::kModel:
      return "a model";
    case FileKind::kCalibration:
      return "a glove's calibration";
    case FileKind::kConfig:
      return "a daemon's config";
    case FileKind::kClip:
      return "a clip";
    case FileKind::kDeviceLog:
      return "a device log";
    case FileKind::kKey:
      return "a key";
    case FileKind::kOther:
      break;
  }
  return "something else";
}

// What the file can be used for.
std::string advice(FileKind kind, std::string_view stream, const std::string& file) {
  switch (kind) {
    case FileKind::kModel:
      return fmt::format("; send it with `posed ctl model {} {}`", stream, file);
    case FileKind::kCalibration:
      return fmt::format("; send it with `posed ctl calibrate {} {}`", stream, file);
    case FileKind::kConfig:
      return "; a daemon reads it when it starts: `posed run --config " + file + "`";
    case FileKind::kClip:
      return "; a model is made from clips by `posed train`";
    case FileKind::kDeviceLog:
      return "; `posed replay " + file + "` plays it";
    case FileKind::kKey:
      return "; it goes with --key or --server-key";
    case FileKind::kOther:
      break;
  }
  return {};
}

}  // namespace

FileKind kind_of(std::string_view bytes) {
  if (bytes.starts_with("POSEDMDL")) return FileKind::kModel;
  if (bytes.starts_with("SQLite format 3")) return FileKind::kDeviceLog;
  if (looks_like_key(bytes)) return FileKind::kKey;
  if (clip::format_of_bytes(bytes) != nullptr) return FileKind::kClip;
  if (bytes.find('\0') != std::string_view::npos) return FileKind::kOther;
  if (has_line(bytes, "[[stream]]") || has_line(bytes, "[[source]]")) return FileKind::kConfig;
  if (has_line(bytes, "[sensors]") && has_line(bytes, "driver")) return FileKind::kCalibration;
  return has_line(bytes, ":units") ? FileKind::kClip : FileKind::kOther;  // the skeleton of an AMC
}

Result<> expect_kind(const std::filesystem::path& path, FileKind wanted, std::string_view stream) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kEnough, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(file.gcount());
  const FileKind kind = kind_of(bytes);
  if (kind == wanted || kind == FileKind::kOther) return {};
  return fail(fmt::format("is {}, not {}{}", kind_name(kind), kind_name(wanted),
                          advice(kind, stream, path.string())),
              path.string());
}

}  // namespace posed::tools
