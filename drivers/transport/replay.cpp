#include "drivers/transport/replay.hpp"

#include <algorithm>
#include <cmath>

namespace posed::drivers {
namespace {

constexpr double kLongest_ns = 1e18;  // thirty years: a damaged arrival time must not overflow

}  // namespace

Result<std::unique_ptr<Transport>> ReplayTransport::open(Recording recording,
                                                         std::int64_t origin_ns, double speed) {
  if (!(speed >= 0.0) || !std::isfinite(speed)) {
    return misuse("the speed should be 1 for the recorded pace, a factor of it, or max");
  }
  for (std::size_t i = 0; i < recording.count(); ++i) {
    if (recording.bytes(i).size() > kMaxChunk) {
      return fail("chunk " + std::to_string(i + 1) + " is longer than " +
                  std::to_string(kMaxChunk) + " bytes; the log is damaged");
    }
  }
  auto transport =
      std::unique_ptr<ReplayTransport>(new ReplayTransport(std::move(recording), origin_ns, speed));
  if (auto ok = transport->timer_.open(); !ok) return std::unexpected(ok.error());
  return transport;
}

Result<> ReplayTransport::start(std::int64_t now_ns) {
  start_ns_ = now_ns;
  timer_.at(now_ns);
  return {};
}

// RT-safe.
std::int64_t ReplayTransport::due_ns(std::size_t chunk) const noexcept {
  const double waited_ns =
      (static_cast<double>(recording_.arrival_ns(chunk)) - static_cast<double>(origin_ns_)) /
      speed_;
  return start_ns_ + static_cast<std::int64_t>(std::clamp(waited_ns, 0.0, kLongest_ns));
}

Chunk ReplayTransport::read(std::int64_t now_ns) noexcept {
  if (next_ == recording_.count()) return {.bytes = {}, .end = true};
  if (speed_ == 0.0) {
    gave_ = !gave_;  // one chunk a wake-up, so that other devices get their turn
    if (!gave_) return {};
  } else if (const std::int64_t due = due_ns(next_); now_ns < due) {
    timer_.at(due);
    return {};
  }
  return {.bytes = recording_.bytes(next_++), .end = false};
}

}  // namespace posed::drivers
