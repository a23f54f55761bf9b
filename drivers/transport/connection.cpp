#include "drivers/transport/connection.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <future>
#include <limits>
#include <system_error>
#include <thread>
#include <utility>

#include "drivers/transport/flood.hpp"
#include "drivers/transport/upkeep.hpp"
#include "proto/frame/time.hpp"

namespace posed::drivers {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::size_t kRead = 4096;  // bytes; enough for a HID report or a terminal's buffer
constexpr milliseconds kWritePatience{1000};
constexpr milliseconds kDrainPatience{1000};
constexpr milliseconds kClosePatience{50};
constexpr std::int64_t kOfNoUse_ns = 5 * kNanosPerSecond;
constexpr int kMaxWaiting = 256;  // reads; hidraw keeps 64 reports

bool not_now(int error) noexcept {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

// Uses send() for sockets, because write() to a peer that has gone would end the process.
ssize_t write_some(int fd, std::span<const std::byte> bytes) noexcept {
  const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent >= 0 || errno != ENOTSOCK) return sent;
  return ::write(fd, bytes.data(), bytes.size());
}

// Returns the bytes that a serial port has not sent yet; 0 for any other descriptor.
int unsent_bytes(int fd) noexcept {
  int count = 0;
  return ::isatty(fd) == 1 && ::ioctl(fd, TIOCOUTQ, &count) == 0 ? count : 0;
}

milliseconds left_until(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
  return std::max(left, milliseconds{0});
}

std::string gone(const std::string& name, int error) {
  return name + " has gone (" + (error == 0 ? "hung up" : errno_text(error)) +
         "); plug it in again or switch it on";
}

class LinkTransport final : public Transport, public Upkeep {
 public:
  explicit LinkTransport(Connection link) : link_(std::move(link)) {}
  LinkTransport(const LinkTransport&) = delete;
  LinkTransport& operator=(const LinkTransport&) = delete;
  ~LinkTransport() override {
    if (flood_.has_ended()) link_.pause_host();
  }

  [[nodiscard]] int poll_fd() const noexcept override { return link_.fd(); }
  Result<> start(std::int64_t now_ns) override;
  [[nodiscard]] Chunk read(std::int64_t now_ns) noexcept override;
  RT_SAFE void decoded(bool used) noexcept override {
    if (used) used_ns_.store(read_ns_, std::memory_order_relaxed);
    if (link_.is_of_network()) flood_.decoded(used);
  }
  RT_SAFE void refuse() noexcept override { flood_.end(); }
  [[nodiscard]] bool send(std::span<const std::byte> bytes, std::uint8_t socket) noexcept override;
  void upkeep(std::int64_t now_ns) noexcept override;
  [[nodiscard]] std::string consume_note() override;

 private:
  bool flush() noexcept;

  Connection link_;
  std::int64_t read_ns_ = 0;
  std::int64_t started_ns_ = 0;  // tells this link from the ones before it
  Flood flood_;
  // When the last bytes of use were read; before start() there is nothing to wait for.
  std::atomic<std::int64_t> used_ns_{std::numeric_limits<std::int64_t>::max()};
  bool is_given_up_ = false, is_reported_ = false;  // of the upkeep's thread
  std::array<std::byte, kRead> buffer_;
  // The rest of a message that the device accepted only in part; no other bytes may come between.
  std::array<std::byte, kRead> unsent_;
  std::size_t unsent_from_ = 0, unsent_to_ = 0;
};

// Discards bytes that came while other devices were being opened: they are old, and all would get
// one arrival time. Bounded, because a device may send without pause.
Result<> LinkTransport::start(std::int64_t now_ns) {
  used_ns_.store(now_ns);
  started_ns_ = now_ns;
  for (int i = 0; i < kMaxWaiting && link_.receive(buffer_) > 0; ++i) {
  }
  return {};
}

// One read per call, so that one HID report is one chunk. All devices are opened such that 0 bytes
// mean a hang-up (VMIN is 1). RT-safe except for the read.
Chunk LinkTransport::read(std::int64_t now_ns) noexcept {
  read_ns_ = now_ns;
  flush();
  const bool floods = flood_.has_ended();
  const ssize_t got = floods ? 0 : link_.receive(buffer_);
  if (got > 0) {
    const auto size = static_cast<std::size_t>(got);
    flood_.read(size, now_ns);
    const auto number = static_cast<std::uint64_t>(started_ns_) | Chunk::kLink;
    return {.bytes = {buffer_.data(), size}, .sender = link_.is_of_network() ? number : 0};
  }
  if (got < 0 && not_now(errno)) return {};
  return {.bytes = {}, .lost = true, .foreign = floods || link_.was_browser() ? 1U : 0U};
}

// The reader then finds the link hung up, and the next one is accepted.
void LinkTransport::upkeep(std::int64_t now_ns) noexcept {
  if (link_.listener() < 0 || is_given_up_ || now_ns - used_ns_.load() < kOfNoUse_ns) return;
  pollfd next{.fd = link_.listener(), .events = POLLIN, .revents = 0};
  if (!link_.others_wait() && ::poll(&next, 1, 0) != 1) return;
  is_given_up_ = true;
  ::shutdown(link_.fd(), SHUT_RDWR);
}

std::string LinkTransport::consume_note() {
  const bool floods = flood_.has_ended();
  if (!(is_given_up_ || floods) || is_reported_) return {};
  is_reported_ = true;
  if (!floods) {
    return link_.name() + " has sent nothing of use for 5 s, and another device waits: it is cut";
  }
  return Flood::words(link_.name());
}

// RT-safe except for the write.
bool LinkTransport::flush() noexcept {
  while (unsent_from_ < unsent_to_) {
    const ssize_t sent =
        write_some(link_.fd(), std::span(unsent_).subspan(unsent_from_, unsent_to_ - unsent_from_));
    if (sent <= 0) return false;
    unsent_from_ += static_cast<std::size_t>(sent);
  }
  return true;
}

// RT-safe except for the write.
bool LinkTransport::send(std::span<const std::byte> bytes, std::uint8_t /*socket*/) noexcept {
  if (bytes.size() > unsent_.size() || !flush()) return false;
  const ssize_t sent = write_some(link_.fd(), bytes);
  if (sent < 0) return false;
  const auto rest = bytes.subspan(sent);
  std::memcpy(unsent_.data(), rest.data(), rest.size());
  unsent_from_ = 0;
  unsent_to_ = rest.size();
  return true;
}

}  // namespace

Connection::Connection(int fd, std::string name, std::string identity) noexcept
    : fd_(fd), name_(std::move(name)), identity_(std::move(identity)) {}

Connection::~Connection() { close(); }

// Linux closes a serial port only when what was written is sent, or after 30 s (closing_wait, which
// only root may change), and a glove that hangs takes nothing. Discarding the bytes (TCOFLUSH) does
// not help: Linux 6.1 cannot discard those of a ttyACM. So another thread closes it, and this one
// does not wait for that when posed stops: where a process ends, Linux interrupts its other
// threads.
void Connection::close() noexcept {
  const int fd = std::exchange(fd_, -1);
  if (fd < 0) return;
  if (unsent_bytes(fd) == 0) {
    ::close(fd);
    return;
  }
  try {
    std::packaged_task<void()> task([fd] { ::close(fd); });
    const auto closed = task.get_future();
    std::thread(std::move(task)).detach();
    while (closed.wait_for(kClosePatience) != std::future_status::ready && !cancelled()) {
    }
  } catch (const std::system_error&) {  // no more threads
    ::close(fd);
  }
}

Connection::Connection(Connection&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      listener_(other.listener_),
      host_(other.host_),
      paused_(std::move(other.paused_)),
      name_(std::move(other.name_)),
      identity_(std::move(other.identity_)),
      cancel_(std::move(other.cancel_)),
      undecided_(other.undecided_),
      was_browser_(other.was_browser_),
      first_lines_(other.first_lines_),
      kept_back_(other.kept_back_),
      kept_(other.kept_) {}

Connection& Connection::operator=(Connection&& other) noexcept {
  if (this == &other) return *this;
  close();
  fd_ = std::exchange(other.fd_, -1);
  listener_ = other.listener_;
  host_ = other.host_;
  paused_ = std::move(other.paused_);
  name_ = std::move(other.name_);
  identity_ = std::move(other.identity_);
  cancel_ = std::move(other.cancel_);
  undecided_ = other.undecided_;
  first_lines_ = other.first_lines_;
  was_browser_ = other.was_browser_;
  kept_back_ = other.kept_back_;
  kept_ = other.kept_;
  return *this;
}

ssize_t Connection::receive(std::span<std::byte> buffer) noexcept {
  if (was_browser_) return 0;
  std::ranges::copy(std::span(kept_back_).first(kept_), buffer.begin());
  const ssize_t got = ::read(fd_, buffer.data() + kept_, buffer.size() - kept_);
  if (listener_ < 0 || got <= 0) return got;
  const auto bytes = buffer.first(kept_ + static_cast<std::size_t>(got));
  const Beginning beginning = undecided_ ? beginning_of(bytes) : Beginning::kDevice;
  if (beginning == Beginning::kOpen) {
    kept_ = bytes.size();
    std::ranges::copy(bytes, kept_back_.begin());
    errno = EAGAIN;
    return -1;
  }
  undecided_ = false;
  kept_ = 0;
  was_browser_ = beginning == Beginning::kBrowser || first_lines_.have_request(bytes);
  if (was_browser_) ::shutdown(fd_, SHUT_RDWR);
  return was_browser_ ? 0 : static_cast<ssize_t>(bytes.size());
}

void Connection::wait_for(short events, milliseconds patience) const {
  std::array<pollfd, 2> wanted{
      {{.fd = fd_, .events = events, .revents = 0},
       {.fd = cancel_ ? cancel_->fd() : -1, .events = POLLIN, .revents = 0}}};
  ::poll(wanted.data(), wanted.size(), static_cast<int>(patience.count()));
}

Result<> Connection::write(std::span<const std::byte> bytes) {
  const auto deadline = Clock::now() + kWritePatience;
  while (!bytes.empty()) {
    if (cancelled()) return Cancel::error();
    const ssize_t sent = write_some(fd_, bytes);
    if (sent > 0) {
      bytes = bytes.subspan(sent);
      continue;
    }
    if (sent < 0 && !not_now(errno)) return fail(gone(name_, errno));
    const auto left = left_until(deadline);
    if (left.count() == 0) {
      return fail(name_ + " takes no bytes; check that a glove is on it and switched on");
    }
    wait_for(POLLOUT, left);
  }
  return {};
}

Result<> Connection::write(std::string_view text) { return write(std::as_bytes(std::span(text))); }

Result<std::vector<std::byte>> Connection::read(std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  std::vector<std::byte> bytes(kRead);
  while (true) {
    if (cancelled()) return Cancel::error();
    const ssize_t got = receive(bytes);
    if (got < 0 && not_now(errno)) {
      const auto left = left_until(deadline);
      if (left.count() == 0) return std::vector<std::byte>{};
      wait_for(POLLIN, left);
      continue;
    }
    if (got <= 0) return fail(gone(name_, got == 0 ? 0 : errno));
    bytes.resize(got);
    return bytes;
  }
}

Result<> Connection::drain(std::chrono::milliseconds quiet) {
  const auto deadline = Clock::now() + kDrainPatience;
  while (true) {
    const auto bytes = TRY(read(std::min(quiet, left_until(deadline))));
    if (bytes.empty() || Clock::now() >= deadline) return {};
  }
}

std::unique_ptr<Transport> make_link_transport(Connection link) {
  return std::make_unique<LinkTransport>(std::move(link));
}

}  // namespace posed::drivers
