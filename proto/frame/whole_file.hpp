// Writing a file in one piece: whoever opens it sees all of it, or what was there before. Cold.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>

#include "proto/frame/result.hpp"

namespace posed {

// Writes beside `path` first and then moves the file there. A full disk, an error or Ctrl-C leaves
// what was there before, and no half-written file; only kill -9 or a power cut can leave
// PATH.<pid>.part. A symbolic link stays one: what it names is replaced. SIGINT, SIGTERM and SIGHUP
// wait in this thread until the file is written.
[[nodiscard]] Result<> write_whole_file(const std::filesystem::path& path,
                                        const std::function<void(std::ostream&)>& write);

}  // namespace posed
