#include "daemon/tools/run/set_aside.hpp"

#include <system_error>
#include <utility>

#include "proto/log/schema.hpp"

namespace posed::tools {

Result<SetAside> SetAside::move(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return SetAside({});
  SetAside kept(file);
  std::filesystem::rename(file, kept.aside(), error);
  if (error) {
    kept.file_.clear();
    return fail("cannot be replaced: " + error.message(), file.string());
  }
  for (const char* suffix : log::kFileSuffixes) kept.rename(file, kept.aside(), suffix);
  return kept;
}

SetAside::SetAside(SetAside&& other) noexcept : file_(std::exchange(other.file_, {})) {}

// Files that the failed replacement left beside its log must not be mistaken for files of the old
// log.
SetAside::~SetAside() {
  if (file_.empty()) return;
  for (const char* suffix : log::kFileSuffixes) {
    remove(file_, suffix);
    rename(aside(), file_, suffix);
  }
}

void SetAside::let_go() noexcept {
  if (file_.empty()) return;
  for (const char* suffix : log::kFileSuffixes) remove(aside(), suffix);
  file_.clear();
}

void SetAside::rename(const std::filesystem::path& from, const std::filesystem::path& to,
                      const char* suffix) {
  std::error_code ignored;  // for most suffixes there is no file
  std::filesystem::rename(from.string() + suffix, to.string() + suffix, ignored);
}

void SetAside::remove(const std::filesystem::path& file, const char* suffix) {
  std::error_code ignored;
  std::filesystem::remove(file.string() + suffix, ignored);
}

}  // namespace posed::tools
