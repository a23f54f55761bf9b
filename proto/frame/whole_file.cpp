#include "proto/frame/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <utility>

namespace posed {
namespace {

std::filesystem::path target_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  auto target = std::filesystem::weakly_canonical(path, error);
  return error ? path : target;
}

// The files that never_replace() has named.
struct NewFiles {
  std::mutex mutex{};
  std::set<std::filesystem::path> paths{};

  static std::filesystem::path key(const std::filesystem::path& path) {
    std::error_code error;
    const auto whole = std::filesystem::absolute(path, error);
    return (error ? path : whole).lexically_normal();
  }
  bool contains(const std::filesystem::path& path) {
    const std::scoped_lock lock(mutex);
    return paths.contains(key(path));
  }
};

NewFiles& new_files() {
  static NewFiles files;
  return files;
}

}  // namespace

void never_replace(const std::filesystem::path& path) {
  const std::scoped_lock lock(new_files().mutex);
  new_files().paths.insert(NewFiles::key(path));
}

bool rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  // A file system that knows no such call may still know links, which never replace either.
  if (::link(from.c_str(), to.c_str()) != 0) return false;
  ::unlink(from.c_str());
  return true;
}

HeldSignals::HeldSignals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, signal);
  pthread_sigmask(SIG_BLOCK, &set, &before_);
}

HeldSignals::~HeldSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

WholeFile::WholeFile(const std::filesystem::path& path)
    : path_(path),
      target_(target_of(path)),
      part_(target_.string() + "." + std::to_string(::getpid()) + ".part"),
      file_(part_, std::ios::binary | std::ios::trunc) {}

Result<WholeFile> WholeFile::open(const std::filesystem::path& path) {
  std::error_code none;
  if (std::filesystem::is_symlink(path, none) && !std::filesystem::exists(path, none)) {
    return fail("is a link to a file that is not there: mount or make that, or remove the link",
                path.string());
  }
  WholeFile whole(path);
  if (whole.file_) return whole;
  const std::string why = errno_text();
  whole.part_.clear();
  return fail("cannot be written: " + why, path.string());
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      part_(std::exchange(other.part_, {})),
      file_(std::move(other.file_)) {}

WholeFile::~WholeFile() {
  std::error_code ignored;
  if (!part_.empty()) std::filesystem::remove(part_, ignored);
}

Result<> WholeFile::keep() {
  file_.close();
  if (!file_) return fail("could not be written to its end: " + errno_text(), path_.string());
  const bool must_be_new = new_files().contains(path_);
  const bool renamed = must_be_new ? rename_to_new(part_, target_)
                                   : std::rename(part_.c_str(), target_.c_str()) == 0;
  if (renamed) {
    part_.clear();
    const std::scoped_lock lock(new_files().mutex);
    new_files().paths.erase(NewFiles::key(path_));  // from now on it is this process's own
    return {};
  }
  if (errno != EEXIST) return fail("cannot be written: " + errno_text(), path_.string());
  const std::string part = std::exchange(part_, {}).string();
  return fail("was made by somebody else meanwhile and is kept; what was to be written is " + part,
              path_.string());
}

Result<> write_whole_file(const std::filesystem::path& path,
                          const std::function<void(std::ostream&)>& write) {
  const HeldSignals held;
  auto file = TRY(WholeFile::open(path));
  write(file.out());
  return file.keep();
}

Result<> write_whole_file(const std::filesystem::path& path, std::string_view text) {
  return write_whole_file(path, [&](std::ostream& out) { out << text; });
}

}  // namespace posed
