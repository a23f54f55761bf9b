// Writes a file atomically: a reader sees either all of it or the previous content. Cold.
#pragma once

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iosfwd>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed {

// While one lives, the signals that end the process (SIGINT, SIGTERM, SIGHUP) wait in this thread.
class HeldSignals {
 public:
  HeldSignals();
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;
  ~HeldSignals();

 private:
  sigset_t before_{};
};

// A file that is written piece by piece into PATH.<pid>.part and gets its name only when it is
// whole.
class WholeFile {
 public:
  static Result<WholeFile> open(const std::filesystem::path& path);
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;
  ~WholeFile();  // leaves the previous content, unless keep() was called

  [[nodiscard]] std::ostream& out() { return file_; }
  // Gives the file its name. An error says why it is not there; it then lacks what out() got,
  // except that the error names a file that has all.
  Result<> keep();

 private:
  explicit WholeFile(const std::filesystem::path& path);

  std::filesystem::path path_, target_, part_;  // part_ is empty when there is nothing to remove
  std::ofstream file_;
};

// From now on a file of this name that is there when one is to be written was made by somebody else
// and is never replaced: what was to be written stays beside it. For the whole process, until it
// has written the file itself; any thread.
void never_replace(const std::filesystem::path& path);

// Renames a file. False, with errno: impossible; EEXIST: there is a file of the new name, which
// stays.
[[nodiscard]] bool rename_to_new(const std::filesystem::path& from,
                                 const std::filesystem::path& to);

// Writes a temporary file beside `path`, then renames it. A full disk, an error or Ctrl-C leaves
// the previous content and no half-written file; only kill -9 or a power cut can leave
// PATH.<pid>.part. A symbolic link is kept: the file that it points to is replaced. The signals
// of HeldSignals wait until the file is written.
Result<> write_whole_file(const std::filesystem::path& path,
                          const std::function<void(std::ostream&)>& write);
// Writes the text in the same way.
Result<> write_whole_file(const std::filesystem::path& path, std::string_view text);

}  // namespace posed
