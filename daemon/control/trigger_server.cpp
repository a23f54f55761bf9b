#include "daemon/control/trigger_server.hpp"

#include <array>
#include <utility>

#include <poll.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"
#include "drivers/transport/socket.hpp"

namespace posed::control {
namespace {

constexpr int kDatagramsARound = 16;

}  // namespace

Result<std::unique_ptr<TriggerServer>> TriggerServer::start(const std::string& listen,
                                                            const std::vector<std::string>& peers,
                                                            DaemonControl& daemon_control) {
  const auto address = TRY(drivers::listen_address(listen, peers, "the senders'"));
  auto allowed = TRY(drivers::Peers::parse(peers));
  auto wake = TRY(system::EventFd::open());
  const int fd = drivers::bind_socket(address, SOCK_DGRAM, false);
  if (fd < 0) {
    return fail("the trigger cannot listen on " + listen + ": " + errno_text() +
                "; end the program that has this port, or choose another in [trigger]");
  }
  spdlog::info("trigger: listening on {}", listen);
  return std::unique_ptr<TriggerServer>(
      new TriggerServer(fd, std::move(wake), std::move(allowed), daemon_control));
}

TriggerServer::TriggerServer(int fd, std::unique_ptr<system::EventFd> wake, drivers::Peers peers,
                             DaemonControl& daemon_control)
    : fd_(fd),
      wake_(std::move(wake)),
      peers_(std::move(peers)),
      trigger_(daemon_control, system::monotonic_ns),
      thread_([this] { serve(); }) {}

TriggerServer::~TriggerServer() {
  stop_.store(true, std::memory_order_release);
  wake_->notify();
  thread_.join();
  ::close(fd_);
}

// Between two rounds it pauses, so that a flood costs little of a core; the kernel drops the rest.
void TriggerServer::serve() {
  constexpr int kPause_ms = 10;
  constexpr int kMaxWait_ms = system::kMaxSleep_ns / 1'000'000;
  system::name_thread(kThreadName);
  while (!stop_.load(std::memory_order_acquire)) {
    pulse_.beat();
    int handled = 0;
    while (handled < kDatagramsARound && handle_datagram()) ++handled;
    wake_->going_to_sleep();
    if (!stop_.load(std::memory_order_acquire)) {
      std::array<pollfd, 2> wait{{{.fd = wake_->fd(), .events = POLLIN, .revents = 0},
                                  {.fd = fd_, .events = POLLIN, .revents = 0}}};
      const bool flooded = handled == kDatagramsARound;
      ::poll(wait.data(), flooded ? 1 : 2, flooded ? kPause_ms : kMaxWait_ms);
    }
    wake_->awake();
  }
}

bool TriggerServer::handle_datagram() {
  std::array<char, kMaxTrigger + 1> bytes;  // one more shows that it is too long
  drivers::Address sender;
  const ssize_t size = ::recvfrom(fd_, bytes.data(), bytes.size(), 0, sender.get(), &sender.size);
  if (size < 0) return false;
  if (!peers_.allow(drivers::host_of(sender))) {
    spdlog::warn(
        "trigger: a datagram from {} is ignored ({} so far); to obey this address, name it"
        " in [trigger] peers",
        drivers::host_text(sender), ++strangers_);
    return true;
  }
  trigger_.handle({bytes.data(), static_cast<std::size_t>(size)}, drivers::host_text(sender));
  return true;
}

}  // namespace posed::control
