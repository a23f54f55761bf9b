#include "daemon/tools/live/line_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/types.h>
#include <unistd.h>

namespace posed::tools {

LineFile::~LineFile() {
  if (fd_ >= 0) ::close(fd_);
}

Result<> LineFile::open() {
  fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (overwrite_ ? 0 : O_EXCL), 0666);
  if (fd_ < 0 && errno == EEXIST) {
    return fail("exists already; name another file, or add --overwrite to replace it",
                path_.string());
  }
  if (fd_ >= 0 && ::flock(fd_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(std::exchange(fd_, -1));
    return fail("is being written by another posed; name another file", path_.string());
  }
  if (fd_ >= 0 && ::ftruncate(fd_, 0) == 0) return {};
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
