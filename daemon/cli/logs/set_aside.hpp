// SetAside: a device log that is about to be replaced, kept under another name until its
// replacement is sure to come. Cold.
#pragma once

#include <filesystem>

#include "proto/frame/result.hpp"

namespace posed::cli {

class SetAside {
 public:
  // Renames `file`, if it is there, to <file>.replaced. The error says why that cannot be done.
  [[nodiscard]] static Result<SetAside> move(const std::filesystem::path& file);
  SetAside(SetAside&& other) noexcept;
  SetAside& operator=(SetAside&&) = delete;
  ~SetAside();  // puts the file back, in place of what there is now, unless it was let go

  // The replacement stands: deletes what was set aside.
  void let_go() noexcept;

 private:
  explicit SetAside(std::filesystem::path file) : file_(std::move(file)) {}
  static void rename(const std::filesystem::path& from, const std::filesystem::path& to,
                     const char* suffix);
  static void remove(const std::filesystem::path& file, const char* suffix);
  [[nodiscard]] std::filesystem::path aside() const { return file_.string() + ".replaced"; }

  std::filesystem::path file_;  // empty: there is nothing to put back
};

}  // namespace posed::cli
