#include "drivers/transport/hid_transport.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstring>
#include <utility>

namespace posed::drivers {

HidTransport::HidTransport(Connection link)
    : fd_(link.fd()),
      waiting_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      reader_(make_link_transport(std::move(link))) {}

HidTransport::~HidTransport() {
  if (waiting_ >= 0) ::close(waiting_);
}

// RT-safe but for the write to the eventfd.
bool HidTransport::send(std::span<const std::byte> bytes, std::uint8_t /*socket*/) noexcept {
  if (bytes.size() > sending_.bytes.size()) return false;
  sending_.size = bytes.size();
  std::memcpy(sending_.bytes.data(), bytes.data(), bytes.size());
  const bool queued = queue_.push(sending_);
  if (!queued) dropped_.fetch_add(1, std::memory_order_relaxed);
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t told = ::write(waiting_, &one, sizeof one);
  return queued;
}

void HidTransport::write_waiting() noexcept {
  std::uint64_t rung = 0;
  [[maybe_unused]] const ssize_t cleared = ::read(waiting_, &rung, sizeof rung);
  while (queue_.read_available() > 0) {
    // Messages that piled up behind a slow write: only the newest still matter.
    while (queue_.read_available() > kBacklog) {
      queue_.pop();
      dropped_.fetch_add(1, std::memory_order_relaxed);
    }
    queue_.consume_one([this](const Report& report) {
      // If the device is gone, the reader notices; a report that it does not accept is lost.
      [[maybe_unused]] const ssize_t sent = ::write(fd_, report.bytes.data(), report.size);
    });
  }
}

std::unique_ptr<Transport> make_hid_transport(Connection link) {
  return std::make_unique<HidTransport>(std::move(link));
}

}  // namespace posed::drivers
