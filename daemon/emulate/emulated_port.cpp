#include "daemon/emulate/emulated_port.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace posed::emulate {
namespace {

std::string reason() { return std::error_code(errno, std::generic_category()).message(); }

// Replaces a link that an earlier emulated glove left behind, but no other file.
Result<> make_link(const std::filesystem::path& link, const std::string& target) {
  std::error_code failed;
  const auto before = std::filesystem::read_symlink(link, failed);
  if (!failed && before.string().starts_with("/dev/pts/")) std::filesystem::remove(link, failed);
  std::filesystem::create_symlink(target, link, failed);
  if (!failed) return {};
  if (failed == std::errc::file_exists) {
    return misuse(
        "exists already and is not an emulated glove's link; choose another name for --link",
        link.string());
  }
  return misuse("cannot link to the port: " + failed.message(), link.string());
}

}  // namespace

Result<EmulatedPort> EmulatedPort::open_pty(const std::filesystem::path& link) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 64> name{};
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
      ptsname_r(master, name.data(), name.size()) != 0) {
    const std::string why = reason();
    if (master >= 0) ::close(master);
    return fail("cannot make a pseudo-terminal: " + why);
  }
  const int slave = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  EmulatedPort port(master, slave, name.data(), {});
  termios mode{};
  if (slave < 0 || tcgetattr(slave, &mode) != 0) {
    return fail("cannot open the pseudo-terminal's other side: " + reason());
  }
  cfmakeraw(&mode);
  tcsetattr(slave, TCSANOW, &mode);
  if (link.empty()) return port;
  if (auto made = make_link(link, name.data()); !made) return std::unexpected(made.error());
  port.link_ = link;
  return port;
}

Result<EmulatedPort> EmulatedPort::connect_tcp(const std::string& endpoint) {
  const auto colon = endpoint.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  std::uint16_t number = 0;
  const char* const end = endpoint.data() + endpoint.size();
  if (colon == std::string::npos ||
      std::from_chars(endpoint.data() + colon + 1, end, number).ptr != end || number == 0 ||
      inet_pton(AF_INET, endpoint.substr(0, colon).c_str(), &address.sin_addr) != 1) {
    return misuse("'" + endpoint + "' is not an address; it looks like 127.0.0.1:5200");
  }
  address.sin_port = htons(number);
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const std::string why = reason();
    if (fd >= 0) ::close(fd);
    return fail("nothing listens at " + endpoint + " (" + why +
                "); start posed first, its stream with link = \"tcp\"");
  }
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  return EmulatedPort(fd, -1, endpoint, {});
}

EmulatedPort::EmulatedPort(EmulatedPort&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      other_side_(std::exchange(other.other_side_, -1)),
      name_(std::move(other.name_)),
      link_(std::exchange(other.link_, {})) {}

EmulatedPort::~EmulatedPort() {
  std::error_code ignored;
  // Another emulated glove may have replaced the link meanwhile.
  if (!link_.empty() && std::filesystem::read_symlink(link_, ignored) == name_) {
    std::filesystem::remove(link_, ignored);
  }
  if (other_side_ >= 0) ::close(other_side_);
  if (fd_ >= 0) ::close(fd_);
}

std::optional<std::vector<std::byte>> EmulatedPort::receive(std::chrono::nanoseconds patience) {
  pollfd wait{fd_, POLLIN, 0};
  const auto whole_s = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec timeout{.tv_sec = whole_s.count(), .tv_nsec = (patience - whole_s).count()};
  if (ppoll(&wait, 1, &timeout, nullptr) <= 0) return std::vector<std::byte>{};
  std::vector<std::byte> bytes(4096);
  const ssize_t size = ::read(fd_, bytes.data(), bytes.size());
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return std::vector<std::byte>{};
  if (size <= 0) return std::nullopt;
  bytes.resize(static_cast<std::size_t>(size));
  return bytes;
}

void EmulatedPort::send(std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const bool is_socket = other_side_ < 0;
    const ssize_t sent = is_socket ? ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                                   : ::write(fd_, bytes.data(), bytes.size());
    if (sent <= 0) return;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

}  // namespace posed::emulate
