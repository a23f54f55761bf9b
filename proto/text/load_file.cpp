#include "proto/text/load_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace posed {
namespace {

constexpr std::size_t kBlock = 65536;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

Result<> expect_there(const std::filesystem::path& path) {
  std::error_code why;
  if (std::filesystem::exists(path, why)) return {};
  if (!why) return fail("is not there; check the path", path.string());
  return fail("cannot be reached (" + why.message() + "); check the path", path.string());
}

bool is_written_here(const std::filesystem::path& path) {
  struct stat wanted{};
  if (stat(path.c_str(), &wanted) != 0 || !S_ISREG(wanted.st_mode)) return false;
  std::error_code error;
  std::filesystem::directory_iterator entries("/proc/self/fd", error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const int fd = std::atoi(entries->path().filename().c_str());
    struct stat is{};
    // By its path: fstat on a descriptor that another thread opens meanwhile is, to the thread
    // sanitizer, a data race.
    if ((fcntl(fd, F_GETFL) & O_ACCMODE) == O_RDWR && stat(entries->path().c_str(), &is) == 0 &&
        is.st_dev == wanted.st_dev && is.st_ino == wanted.st_ino) {
      return true;
    }
  }
  return false;
}

Result<std::string> load_file(const std::filesystem::path& path, const FileRule& rule) {
  const std::string what(rule.what);
  const auto refused = [&path](const std::string& sentence) {
    return fail(sentence, path.string());
  };
  if (is_written_here(path)) return refused("is being written by posed; name another file");
  // Without O_NONBLOCK, opening a pipe would wait until another process writes into it.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file.get() < 0) {
    return refused("cannot read the " + what + ": " + errno_text() + "; check the path");
  }
  struct stat about{};
  if (fstat(file.get(), &about) != 0)
    return refused("cannot read the " + what + ": " + errno_text());
  if (S_ISDIR(about.st_mode)) return refused("this is a folder; name a " + what + " in it");
  if (!S_ISREG(about.st_mode)) {
    return refused("this is a device or a pipe; name a " + what + " that is a regular file");
  }
  const std::string too_large =
      "is larger than " + size_text(rule.max_bytes) + ": that is no " + what;
  const auto promised = static_cast<std::uintmax_t>(std::max<off_t>(about.st_size, 0));
  if (promised > rule.max_bytes) return refused(too_large);
  // Reads one byte more than the size, to see the end; kernel files (/proc) report size 0.
  std::string bytes;
  std::size_t size = 0;
  while (true) {
    if (size == bytes.size()) {
      bytes.resize(std::max<std::size_t>(size + kBlock, static_cast<std::size_t>(promised) + 1));
    }
    const ssize_t got = read(file.get(), bytes.data() + size, bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return refused("cannot read the " + what + " to its end: " + errno_text());
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
    if (size > rule.max_bytes) return refused(too_large);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace posed
