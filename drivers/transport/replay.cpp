#include "drivers/transport/replay.hpp"

#include <algorithm>
#include <cmath>

namespace posed::drivers {
namespace {

constexpr double kMaxTime_ns = 1e18;  // thirty years: a damaged arrival time must not overflow

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
  return std::unique_ptr<Transport>(new ReplayTransport(std::move(recording), origin_ns, speed));
}

Result<> ReplayTransport::start(std::int64_t now_ns) {
  start_ns_ = now_ns;
  return {};
}

RT_SAFE std::int64_t ReplayTransport::next_due_ns() const noexcept {
  if (speed_ == 0.0 || next_ == recording_.count()) return start_ns_;
  const double waited_ns =
      (static_cast<double>(recording_.arrival_ns(next_)) - static_cast<double>(origin_ns_)) /
      speed_;
  return start_ns_ + static_cast<std::int64_t>(std::clamp(waited_ns, 0.0, kMaxTime_ns));
}

RT_SAFE Chunk ReplayTransport::read(std::int64_t now_ns) noexcept {
  if (next_ == recording_.count()) return {.bytes = {}, .end = true};
  if (now_ns < next_due_ns()) return {};
  const std::size_t chunk = next_++;
  return {.bytes = recording_.bytes(chunk), .socket = recording_.socket(chunk)};
}

}  // namespace posed::drivers
