// HotplugMonitor: tells when a device may have come, so that a glove that is device in again is
// tried at once and not at the next turn of a timer. It watches the folders of device nodes with
// inotify, which needs no udev daemon: it works in a container and in an initramfs, too.
#pragma once

#include <string>
#include <vector>

namespace posed::drivers {

class HotplugMonitor {
 public:
  // Watches /dev and the folders below /dev/bus/usb; a folder that is missing is watched as soon as
  // it is there. `root` replaces /dev in tests.
  explicit HotplugMonitor(std::string root = "/dev");
  ~HotplugMonitor();
  HotplugMonitor(const HotplugMonitor&) = delete;
  HotplugMonitor& operator=(const HotplugMonitor&) = delete;

  // Readable when a node came or its permissions changed; -1 when the system has no watch left:
  // then trying now and again is all there is.
  [[nodiscard]] int poll_fd() const noexcept { return fd_; }

  // Takes what was told; whether a node came since the last call. Cold.
  bool take();

 private:
  void watch_folders();

  int fd_;
  std::string root_;
};

}  // namespace posed::drivers
