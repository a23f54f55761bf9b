// SetAside keeps a device log that is about to be replaced under another name until the new log has
// been started successfully. Cold.
#pragma once

#include <filesystem>

#include "proto/frame/result.hpp"

namespace posed::tools {

class SetAside {
 public:
  // Renames `file`, if it exists, to <file>.replaced. The error says why that is impossible.
  [[nodiscard]] static Result<SetAside> move(const std::filesystem::path& file);
  SetAside(SetAside&& other) noexcept;
  SetAside& operator=(SetAside&&) = delete;
  ~SetAside();  // restores the file over the new one, unless let_go() was called

  // The replacement has succeeded: deletes the old file.
  void let_go() noexcept;

 private:
  explicit SetAside(std::filesystem::path file) : file_(std::move(file)) {}
  static void rename(const std::filesystem::path& from, const std::filesystem::path& to,
                     const char* suffix);
  static void remove(const std::filesystem::path& file, const char* suffix);
  [[nodiscard]] std::filesystem::path aside() const { return file_.string() + ".replaced"; }

  std::filesystem::path file_;  // empty: nothing to restore
};

}  // namespace posed::tools
