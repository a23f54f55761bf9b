#include "daemon/tools/live/line_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

namespace posed::tools {

LineFile::~LineFile() {
  if (fd_ >= 0) ::close(fd_);
}

Result<> LineFile::open() {
  fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd_ >= 0) return {};
  return fail("cannot be written (" + errno_text() + "); name a file elsewhere", path_.string());
}

Result<> LineFile::add(std::string_view line) {
  if (fd_ < 0) {
    TRY(open());
  }
  const std::string text = std::string(line) + '\n';
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t more = ::write(fd_, text.data() + written, text.size() - written);
    if (more > 0) written += static_cast<std::size_t>(more);
    if (more > 0 || (more < 0 && errno == EINTR)) continue;
    const std::string why = errno_text();
    [[maybe_unused]] const int cut = ::ftruncate(fd_, static_cast<off_t>(size_));
    return fail("no more can be written (" + why + "); the lines before are whole; free some space",
                path_.string());
  }
  size_ += text.size();
  return {};
}

}  // namespace posed::tools
