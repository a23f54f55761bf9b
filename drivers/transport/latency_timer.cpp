#include "drivers/transport/latency_timer.hpp"

#include <linux/serial.h>
#include <sys/ioctl.h>

#include <fstream>

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

constexpr int kAtOnce_ms = 1;  // the least that an FTDI chip accepts

// 0 if there is no timer.
int latency_ms(const fs::path& timer) {
  int ms = 0;
  std::ifstream(timer) >> ms;
  return ms;
}

// Ports that do not offer it return an error, which is ignored.
void set_low_latency(int fd) {
  serial_struct port{};
  if (::ioctl(fd, TIOCGSERIAL, &port) != 0) return;
  port.flags |= ASYNC_LOW_LATENCY;
  ::ioctl(fd, TIOCSSERIAL, &port);
}

}  // namespace

std::string ask_for_low_latency(int fd, const std::string& node, const fs::path& sys) {
  std::error_code failed;
  const fs::path port = fs::canonical(node, failed);  // /dev/serial/by-id has links
  const fs::path name = failed ? fs::path(node).filename() : port.filename();
  const fs::path timer = sys / "bus/usb-serial/devices" / name / "latency_timer";
  const int before = latency_ms(timer);
  set_low_latency(fd);
  if (before <= kAtOnce_ms) return {};
  if (latency_ms(timer) > kAtOnce_ms) std::ofstream(timer) << kAtOnce_ms << std::flush;
  const int after = latency_ms(timer);
  const std::string was = std::to_string(before) + " ms";
  if (after <= kAtOnce_ms) return "its USB adapter collected bytes for " + was + ", now for 1 ms";
  return "its USB adapter collects bytes for " + was + "; `posed doctor` says how to change that";
}

}  // namespace posed::drivers
