// Writes a file atomically: a reader sees either all of it or the previous content. Cold.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>

#include "proto/frame/result.hpp"

namespace posed {

// Writes a temporary file beside `path`, then renames it. A full disk, an error or Ctrl-C leaves
// the previous content and no half-written file; only kill -9 or a power cut can leave
// PATH.<pid>.part. A symbolic link is kept: the file that it points to is replaced. SIGINT, SIGTERM
// and SIGHUP wait in this thread until the file is written.
[[nodiscard]] Result<> write_whole_file(const std::filesystem::path& path,
                                        const std::function<void(std::ostream&)>& write);

}  // namespace posed
