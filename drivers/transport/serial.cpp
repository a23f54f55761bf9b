// Serial ports by the kernel's own interface: termios2 takes any baud rate as a number, and a
// pseudo-terminal, which serves emulators and tests, is opened like a port (libserialport refuses
// it).
#include <asm/termbits.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "drivers/transport/node.hpp"
#include "drivers/transport/ports.hpp"

namespace posed::drivers {
namespace {

constexpr double kBaudError = 0.03;  // of which a UART reads every bit of a byte, still
constexpr unsigned kFirstPtyMajor = 136, kLastPtyMajor = 143;  // Unix98 pseudo-terminals

bool is_pseudo_terminal(int fd) {
  struct stat info{};
  if (::fstat(fd, &info) != 0) return false;
  const unsigned number = major(info.st_rdev);
  return number >= kFirstPtyMajor && number <= kLastPtyMajor;
}

// Raw 8N1 without flow control. A read without bytes fails with EAGAIN and gives 0 only after a
// hang-up (VMIN 1). Closing leaves DTR up: boards with a boot loader start anew when it drops.
Result<> set_raw(int fd, const SerialSettings& settings) {
  termios2 mode{};
  if (::ioctl(fd, TCGETS2, &mode) != 0) {
    return fail(settings.port + " is no serial port; see `posed devices` for those that are");
  }
  mode.c_iflag = IGNBRK | IGNPAR;
  mode.c_oflag = 0;
  mode.c_lflag = 0;
  mode.c_cflag = BOTHER | CS8 | CREAD | CLOCAL;
  mode.c_cc[VMIN] = 1;
  mode.c_cc[VTIME] = 0;
  mode.c_ispeed = mode.c_ospeed = static_cast<speed_t>(settings.baud);
  if (::ioctl(fd, TCSETS2, &mode) != 0 || ::ioctl(fd, TCGETS2, &mode) != 0) {
    return fail(settings.port + " refuses " + std::to_string(settings.baud) + " baud (" +
                std::strerror(errno) + ")");
  }
  if (std::abs(static_cast<double>(mode.c_ospeed) - settings.baud) > kBaudError * settings.baud) {
    return fail(settings.port + " cannot run at " + std::to_string(settings.baud) +
                " baud; its nearest rate is " + std::to_string(mode.c_ospeed));
  }
  return {};
}

}  // namespace

Result<Link> Ports::serial(const SerialSettings& settings) {
  if (settings.baud <= 0) return misuse("baud should be more than 0");
  const auto fd = open_node(settings.port);
  if (!fd) return std::unexpected(fd.error());
  Link link(*fd, settings.port, settings.port);
  if (auto ok = set_raw(*fd, settings); !ok) return std::unexpected(ok.error());
  // flock keeps a second posed out; this keeps out the programs that know nothing of flock. Not on
  // a pseudo-terminal: there it would outlast us while the other side keeps the node open.
  if (!is_pseudo_terminal(*fd) && ::ioctl(*fd, TIOCEXCL) != 0) {
    return fail(node_trouble(settings.port, errno));
  }
  const int lines = TIOCM_DTR | TIOCM_RTS;
  ::ioctl(*fd, TIOCMBIS, &lines);   // a port without modem lines answers with an error, rightly
  ::ioctl(*fd, TCFLSH, TCIOFLUSH);  // what lies there was sent to someone else, at another rate
  return link;
}

}  // namespace posed::drivers
