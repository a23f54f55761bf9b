// HotplugMonitor: reports when a device may have been connected, so that a replugged glove is tried
// at once and not at the next timer event. It watches the folders of device nodes with inotify,
// which needs no udev daemon: it also works in a container and in an initramfs.
#pragma once

#include <string>

namespace posed::drivers {

class HotplugMonitor {
 public:
  // Watches /dev and the folders below /dev/bus/usb; a missing folder is watched as soon as it
  // exists. `root` replaces /dev in tests.
  explicit HotplugMonitor(std::string root = "/dev");
  ~HotplugMonitor();
  HotplugMonitor(const HotplugMonitor&) = delete;
  HotplugMonitor& operator=(const HotplugMonitor&) = delete;

  // Readable when a node appeared or its permissions changed; -1 when the system has no inotify
  // watch left: then the caller can only retry from time to time.
  [[nodiscard]] int poll_fd() const noexcept { return fd_; }

  // Consumes the pending events; returns true when a node appeared since the last call. Cold.
  bool consume();

 private:
  void watch_folders();

  int fd_;
  std::string root_;
};

}  // namespace posed::drivers
