#include "drivers/transport/node.hpp"

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

bool holds(const fs::path& descriptors, const fs::path& node) {
  std::error_code ignored;  // processes come and go, and those of other users may be unreadable
  for (fs::directory_iterator fd(descriptors, ignored), end; !ignored && fd != end;
       fd.increment(ignored)) {
    std::error_code unreadable;
    if (fs::read_symlink(fd->path(), unreadable) == node && !unreadable) return true;
  }
  return false;
}

// " by NAME (process ID)" of another process that has the node open; empty when none is visible.
std::string holder_of(const std::string& path) {
  std::error_code ignored;
  const fs::path node = fs::canonical(path, ignored);
  for (fs::directory_iterator process("/proc", ignored), end; !ignored && process != end;
       process.increment(ignored)) {
    const std::string id = process->path().filename();
    if (id.find_first_not_of("0123456789") != std::string::npos || id == std::to_string(getpid()) ||
        !holds(process->path() / "fd", node)) {
      continue;
    }
    std::string name;
    std::getline(std::ifstream(process->path() / "comm"), name);
    return name.insert(0, " by ").append(" (process ").append(id).append(")");
  }
  return {};
}

std::string group_of(const std::string& path) {
  struct stat info{};
  if (::stat(path.c_str(), &info) != 0) return "dialout";
  const group* found = ::getgrgid(info.st_gid);
  // A node in root's own group needs the udev rule; nobody should join that group. A service with
  // PrivateUsers= sees the other groups as the one that stands for unknown ones.
  constexpr gid_t kUnknown = 65534;
  const bool joinable = found != nullptr && info.st_gid != 0 && info.st_gid != kUnknown;
  return joinable ? found->gr_name : "";
}

}  // namespace

std::string node_open_error(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
    case EIO:
      return path + " is not there; plug the glove in, or see `posed devices` for what is";
    case EPERM:  // not the node's mode, which gives EACCES, but the rules around this process
      return "this service or container may not open " + path +
             "; allow it there (systemd: DeviceAllow=" + path + " rw)";
    case EACCES: {
      const std::string group = group_of(path);
      return "no permission for " + path +
             "; install config/udev/70-posed.rules and plug the glove in again" +
             (group.empty() ? "" : ", or join its group: sudo usermod -aG " + group + " $USER");
    }
    case EBUSY:
    case EWOULDBLOCK: {
      const std::string holder = holder_of(path);
      return path + " is in use" + (holder.empty() ? " by another stream or program" : holder) +
             "; end that first";
    }
    default:
      return path + " does not open (" + errno_text(error) + ")";
  }
}

Result<int> open_node(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return fail(node_open_error(path, errno));
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(fd);
    return fail(node_open_error(path, EBUSY));
  }
  return fd;
}

}  // namespace posed::drivers
