#include "daemon/tools/emulate/emulated_device.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "daemon/system/clock.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/transport/address.hpp"
#include "drivers/transport/socket.hpp"
#include "proto/text/list.hpp"

namespace posed::emulate {
namespace {

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

// This port of the machine, as the host at `host` reaches it: on the loopback only if the host is
// there.
drivers::Address own_address(const drivers::Address& host, std::uint16_t port) {
  const bool v6 = host.storage.ss_family == AF_INET6;
  const bool here = drivers::is_loopback(drivers::host_of(host));
  const std::string any = v6 ? "[::]:" : "0.0.0.0:";
  const std::string loopback = v6 ? "[::1]:" : "127.0.0.1:";
  return drivers::parse_endpoint((here ? loopback : any) + std::to_string(port)).value();
}

}  // namespace

Result<EmulatedPort> EmulatedPort::open_pty(const std::filesystem::path& link) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 64> name{};
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
      ptsname_r(master, name.data(), name.size()) != 0) {
    const std::string why = errno_text();
    if (master >= 0) ::close(master);
    return fail("cannot make a pseudo-terminal: " + why);
  }
  const int slave = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  EmulatedPort port(Kind::kTerminal, {master}, name.data());
  port.other_side_ = slave;
  termios mode{};
  if (slave < 0 || tcgetattr(slave, &mode) != 0) {
    return fail("cannot open the pseudo-terminal's other side: " + errno_text());
  }
  cfmakeraw(&mode);
  tcsetattr(slave, TCSANOW, &mode);
  if (link.empty()) return port;
  TRY(make_link(link, name.data()));
  port.link_ = link;
  return port;
}

Result<EmulatedPort> EmulatedPort::connect_tcp(const std::string& endpoint) {
  const auto address = TRY(drivers::parse_endpoint(endpoint));
  const int fd = ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || ::connect(fd, address.get(), address.size) != 0) {
    const std::string why = errno_text();
    if (fd >= 0) ::close(fd);
    return fail("nothing listens at " + endpoint + " (" + why +
                "); start posed first, its stream with link = \"tcp\"");
  }
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  return EmulatedPort(Kind::kTcp, {fd}, endpoint);
}

Result<EmulatedPort> EmulatedPort::listen_tcp(const std::string& endpoint) {
  const auto address = TRY(drivers::parse_endpoint(endpoint));
  EmulatedPort port(Kind::kTcpServer, {}, "");
  port.listener_ = TRY(drivers::listen_on(address, endpoint, 1));
  port.name_ = drivers::endpoint_text(drivers::bound_address(port.listener_));
  return port;
}

Result<EmulatedPort> EmulatedPort::open_udp(const std::vector<std::string>& endpoints,
                                            const std::vector<std::uint16_t>& ports) {
  EmulatedPort port(Kind::kUdp, {}, "");
  for (std::size_t i = 0; i < endpoints.size(); ++i) {
    const std::string& endpoint = endpoints[i];
    const auto address = TRY(drivers::parse_endpoint(endpoint));
    const int fd = drivers::open_socket(address, SOCK_DGRAM);
    if (fd >= 0) port.fds_.push_back(fd);
    if (fd >= 0 && i < ports.size() && ports[i] != 0) {
      const auto own = own_address(address, ports[i]);
      if (::bind(fd, own.get(), own.size) != 0) {
        return fail("cannot use the device's port " + std::to_string(ports[i]) + " (" +
                    errno_text() + "); end the program that has it");
      }
    }
    if (fd < 0 || ::connect(fd, address.get(), address.size) != 0) {
      return fail("cannot send to " + endpoint + " (" + errno_text() +
                  "); name an address that this machine reaches");
    }
    add_word(port.name_, endpoint);
  }
  return port;
}

Result<EmulatedPort> EmulatedPort::publish(const std::string& endpoint) {
  EmulatedPort port(Kind::kPublish, {}, "");
  port.context_ = TRY(net::open_context());
  port.publisher_ = TRY(net::open_socket(port.context_.get(), ZMQ_PUB));
  port.name_ = TRY(net::bind_socket(port.publisher_.get(), endpoint));
  return port;
}

EmulatedPort::EmulatedPort(EmulatedPort&& other) noexcept
    : kind_(other.kind_),
      fds_(std::exchange(other.fds_, {})),
      other_side_(std::exchange(other.other_side_, -1)),
      listener_(std::exchange(other.listener_, -1)),
      name_(std::move(other.name_)),
      link_(std::exchange(other.link_, {})),
      context_(std::move(other.context_)),
      publisher_(std::move(other.publisher_)) {}

EmulatedPort::~EmulatedPort() {
  std::error_code ignored;
  // Another emulated glove may have replaced the link meanwhile.
  if (!link_.empty() && std::filesystem::read_symlink(link_, ignored) == name_) {
    std::filesystem::remove(link_, ignored);
  }
  if (other_side_ >= 0) ::close(other_side_);
  if (listener_ >= 0) ::close(listener_);
  for (const int fd : fds_) ::close(fd);
}

void EmulatedPort::accept() noexcept {
  const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  for (const int before : fds_) ::close(before);
  fds_.assign(1, fd);
}

std::optional<EmulatedPort::Received> EmulatedPort::receive(std::chrono::nanoseconds patience) {
  std::vector<pollfd> wait;
  wait.reserve(fds_.size() + 1);
  for (const int fd : fds_) wait.push_back({.fd = fd, .events = POLLIN, .revents = 0});
  if (listener_ >= 0) wait.push_back({.fd = listener_, .events = POLLIN, .revents = 0});
  const auto whole_s = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec timeout{.tv_sec = whole_s.count(), .tv_nsec = (patience - whole_s).count()};
  if (ppoll(wait.data(), wait.size(), &timeout, nullptr) <= 0) return Received{};
  const auto ready = std::ranges::find_if(wait, [](const pollfd& fd) { return fd.revents != 0; });
  if (ready->fd == listener_) {
    accept();
    return Received{};
  }
  Received received{.socket = static_cast<std::uint8_t>(ready - wait.begin()),
                    .bytes = std::vector<std::byte>(drivers::kMaxChunk)};
  const ssize_t size = ::read(ready->fd, received.bytes.data(), received.bytes.size());
  // A UDP host that is not there yet answers with an error.
  const bool later = kind_ == Kind::kUdp || errno == EAGAIN || errno == EINTR;
  if (size < 0 && later) return Received{};
  if (size <= 0 && kind_ == Kind::kTcpServer) {  // the next host may come
    ::close(ready->fd);
    fds_.clear();
    return Received{};
  }
  if (size <= 0 && kind_ != Kind::kUdp) return std::nullopt;
  received.bytes.resize(size);
  return received;
}

void EmulatedPort::send(std::uint8_t socket, std::span<const std::byte> bytes) noexcept {
  if (kind_ == Kind::kPublish) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto end = std::min(text.find('\0'), text.size());
    if (!net::send_part(publisher_.get(), text.substr(0, end), true)) return;
    static_cast<void>(
        net::send_part(publisher_.get(), text.substr(std::min(end + 1, text.size())), false));
    return;
  }
  if (socket >= fds_.size()) return;
  while (!bytes.empty()) {
    const ssize_t sent = kind_ == Kind::kTerminal
                             ? ::write(fds_[socket], bytes.data(), bytes.size())
                             : ::send(fds_[socket], bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;
    bytes = bytes.subspan(sent);
  }
}

namespace {

// How long it may take until a stop is noticed.
constexpr std::int64_t kLookEvery_ns = 50'000'000;
// After the process was suspended, the device does not send everything that it missed.
constexpr int kPacketsInARow = 16;

}  // namespace

HandAngles pose_at(const clip::HandClip& clip, double time_s) {
  const double begin_s = clip.time_s.front();
  const double length_s = clip.time_s.back() - begin_s;
  const double at_s = begin_s + (length_s > 0.0 ? std::fmod(std::max(time_s, 0.0), length_s) : 0.0);
  const auto next = std::ranges::upper_bound(clip.time_s, at_s);
  const auto after = std::min<std::size_t>(static_cast<std::size_t>(next - clip.time_s.begin()),
                                           clip.time_s.size() - 1);
  const std::size_t before = after == 0 ? 0 : after - 1;
  const double step_s = clip.time_s[after] - clip.time_s[before];
  const double share = step_s > 0.0 ? (at_s - clip.time_s[before]) / step_s : 0.0;
  HandAngles pose{};
  for (std::size_t i = 0; i < pose.size(); ++i) {
    const double value = std::lerp(clip.angles[before][i], clip.angles[after][i], share);
    pose[i] = std::isfinite(value) ? value : 0.0;
  }
  return pose;
}

Motion hand_motion(std::function<HandAngles(double time_s)> angles_at) {
  return [angles_at = std::move(angles_at)](double time_s, drivers::Emulator& emulator) {
    emulator.pose(0, drivers::glove::hand_frame(angles_at(time_s)));
  };
}

EmulatedDevice::EmulatedDevice(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                               Motion motion, Settings settings)
    : emulator_(std::move(emulator)),
      port_(std::move(port)),
      motion_(std::move(motion)),
      settings_(std::move(settings)) {}

void EmulatedDevice::run(const std::stop_token& stop) {
  const std::int64_t start_ns = system::monotonic_ns();
  const auto device_time_ns = [&] {
    return static_cast<std::int64_t>(static_cast<double>(system::monotonic_ns() - start_ns) *
                                     settings_.speed);
  };
  while (!stop.stop_requested()) {
    const std::int64_t due_ns = emulator_->next_due_ns();
    std::int64_t wait_ns = kLookEvery_ns;
    if (due_ns != kNoTime_ns) {
      const auto until_ns = static_cast<std::int64_t>(
          static_cast<double>(due_ns - device_time_ns()) / std::max(settings_.speed, 1e-3));
      wait_ns = std::clamp<std::int64_t>(until_ns, 0, kLookEvery_ns);
    }
    const auto received = port_.receive(std::chrono::nanoseconds(wait_ns));
    if (!received) return;
    const std::int64_t now_ns = device_time_ns();
    if (motion_) motion_(seconds(now_ns), *emulator_);
    if (!received->bytes.empty()) {
      Bytes answer;
      emulator_->receive_socket(received->socket, received->bytes, now_ns, answer);
      port_.send(received->socket, answer);
    }
    emit(now_ns);
  }
}

void EmulatedDevice::emit(std::int64_t device_ns) {
  for (int i = 0; i < kPacketsInARow; ++i) {
    const std::int64_t due_ns = emulator_->next_due_ns();
    if (due_ns == kNoTime_ns || due_ns > device_ns) return;
    packet_.clear();
    const std::uint8_t socket = emulator_->next_socket();
    emulator_->emit(device_ns, packet_);
    ++packets_;
    for (auto& fault : settings_.faults) {
      passed_.clear();
      static_cast<void>(fault.pass(packet_, device_ns, passed_));
      std::swap(packet_, passed_);
    }
    port_.send(socket, packet_);
  }
}

}  // namespace posed::emulate
