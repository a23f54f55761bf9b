// Serial ports by the kernel's own interface: termios2 accepts any baud rate as a number, and a
// pseudo-terminal, used by emulators and tests, is opened like a port (libserialport rejects it).
#include <asm/termbits.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/node.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

constexpr double kBaudError = 0.03;  // with this error a UART still reads every bit of a byte
constexpr unsigned kFirstPtyMajor = 136, kLastPtyMajor = 143;  // Unix98 pseudo-terminals

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

bool is_pseudo_terminal(int fd) {
  struct stat info{};
  if (::fstat(fd, &info) != 0) return false;
  const unsigned number = major(info.st_rdev);
  return number >= kFirstPtyMajor && number <= kLastPtyMajor;
}

// Sets raw 8N1 without flow control. A read without bytes fails with EAGAIN and returns 0 only
// after a hang-up (VMIN 1). Closing keeps DTR set: boards with a boot loader restart when it drops.
Result<> set_raw(int fd, const std::string& port, int baud) {
  termios2 mode{};
  if (::ioctl(fd, TCGETS2, &mode) != 0) {
    return fail(port + " is no serial port; see `posed devices` for those that are");
  }
  mode.c_iflag = IGNBRK | IGNPAR;
  mode.c_oflag = 0;
  mode.c_lflag = 0;
  mode.c_cflag = BOTHER | CS8 | CREAD | CLOCAL;
  mode.c_cc[VMIN] = 1;
  mode.c_cc[VTIME] = 0;
  mode.c_ispeed = mode.c_ospeed = static_cast<speed_t>(baud);
  if (::ioctl(fd, TCSETS2, &mode) != 0 || ::ioctl(fd, TCGETS2, &mode) != 0) {
    return fail(port + " refuses " + std::to_string(baud) + " baud (" + errno_text() + ")");
  }
  serial_struct uart{};  // a port without one (the gadget side of a USB cable) has no rate at all
  if (::ioctl(fd, TIOCGSERIAL, &uart) == 0 &&
      std::abs(static_cast<double>(mode.c_ospeed) - baud) > kBaudError * baud) {
    return fail(port + " cannot run at " + std::to_string(baud) + " baud; its nearest rate is " +
                std::to_string(mode.c_ospeed));
  }
  return {};
}

Result<DeviceInfo> find_port(const SerialSettings& settings) {
  const auto ports = list_serial_ports();
  if (!settings.port.empty()) return find_node(ports, settings.port);
  const auto wanted = [&](const DeviceInfo& one) {
    const auto ids = std::uint32_t{one.vendor} << 16 | one.product;
    return !settings.id.empty() ||
           (one.is_usb && std::ranges::find(settings.usb_ids, ids) != settings.usb_ids.end());
  };
  return choose(ports, settings.id, wanted, "serial port");
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

Result<Connection> TransportFactory::serial(const SerialSettings& settings) {
  if (settings.baud <= 0) return misuse("baud should be more than 0");
  if (only_prepare_) return not_opened();
  const auto port = TRY(find_port(settings));
  const auto fd = TRY(open_node(port.node));
  Connection link(fd, port.node, port.identity());
  link.heed(cancel_);
  TRY(set_raw(fd, port.node, settings.baud));
  // flock keeps out a second posed; TIOCEXCL keeps out programs that do not use flock. Not on a
  // pseudo-terminal: there it would remain set while the other side keeps the node open.
  if (!is_pseudo_terminal(fd) && ::ioctl(fd, TIOCEXCL) != 0) {
    return fail(node_open_error(port.node, errno));
  }
  const int lines = TIOCM_DTR | TIOCM_RTS;
  ::ioctl(fd, TIOCMBIS, &lines);  // a port without modem lines returns an error, which is ignored
  if (auto note = ask_for_low_latency(fd, port.node); !note.empty()) note_ = std::move(note);
  // Discards old bytes, which were meant for another program or came at another rate.
  ::ioctl(fd, TCFLSH, TCIOFLUSH);
  return link;
}

}  // namespace posed::drivers
