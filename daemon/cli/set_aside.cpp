#include "daemon/cli/set_aside.hpp"

#include <array>
#include <system_error>
#include <utility>

namespace posed::cli {
namespace {

// What SQLite keeps beside a log that was not closed; any other file has none of it.
constexpr std::array kBeside{"-wal", "-shm"};

}  // namespace

Result<SetAside> SetAside::move(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return SetAside({});
  SetAside kept(file);
  std::filesystem::rename(file, kept.aside(), error);
  if (error) {
    kept.file_.clear();
    return fail("cannot be replaced: " + error.message(), file.string());
  }
  for (const char* suffix : kBeside) {
    std::filesystem::rename(file.string() + suffix, kept.aside().string() + suffix, error);
  }
  return kept;
}

SetAside::SetAside(SetAside&& other) noexcept : file_(std::exchange(other.file_, {})) {}

SetAside::~SetAside() {
  if (file_.empty()) return;
  std::error_code ignored;
  std::filesystem::rename(aside(), file_, ignored);
  for (const char* suffix : kBeside) {
    std::filesystem::rename(aside().string() + suffix, file_.string() + suffix, ignored);
  }
}

void SetAside::let_go() noexcept {
  if (file_.empty()) return;
  std::error_code ignored;
  std::filesystem::remove(aside(), ignored);
  for (const char* suffix : kBeside) {
    std::filesystem::remove(aside().string() + suffix, ignored);
  }
  file_.clear();
}

}  // namespace posed::cli
