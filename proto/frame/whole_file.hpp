// Writes a file atomically: a reader sees either all of it or the previous content. Cold.
#pragma once

#include <csignal>
#include <filesystem>
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

// Writes a temporary file beside `path`, then renames it. A full disk, an error or Ctrl-C leaves
// the previous content and no half-written file; only kill -9 or a power cut can leave
// PATH.<pid>.part. A symbolic link is kept: the file that it points to is replaced. The signals
// of HeldSignals wait until the file is written.
Result<> write_whole_file(const std::filesystem::path& path,
                          const std::function<void(std::ostream&)>& write);
// Writes the text in the same way.
Result<> write_whole_file(const std::filesystem::path& path, std::string_view text);

}  // namespace posed
