#include "drivers/transport/hotplug_monitor.hpp"

#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <utility>

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

// A udev rule that gives posed access changes the node's attributes shortly after it was created.
constexpr std::uint32_t kNews = IN_CREATE | IN_MOVED_TO | IN_ATTRIB | IN_ONLYDIR;

}  // namespace

HotplugMonitor::HotplugMonitor(std::string root)
    : fd_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)), root_(std::move(root)) {
  watch_folders();
}

HotplugMonitor::~HotplugMonitor() {
  if (fd_ >= 0) ::close(fd_);
}

// Watching a folder twice has no effect, so all of them are watched again after every event.
void HotplugMonitor::watch_folders() {
  if (fd_ < 0) return;
  const fs::path buses = fs::path(root_) / "bus/usb";
  for (const fs::path& folder : {fs::path(root_), fs::path(root_) / "bus", buses}) {
    ::inotify_add_watch(fd_, folder.c_str(), kNews);
  }
  std::error_code failed;
  for (fs::directory_iterator bus(buses, failed), end; !failed && bus != end;
       bus.increment(failed)) {
    ::inotify_add_watch(fd_, bus->path().c_str(), kNews);
  }
}

bool HotplugMonitor::consume() {
  alignas(inotify_event) std::array<char, 4096> events;
  bool any = false;
  while (fd_ >= 0 && ::read(fd_, events.data(), events.size()) > 0) any = true;
  if (any) watch_folders();
  return any;
}

}  // namespace posed::drivers
