#include "drivers/transport/file.hpp"

#include <cmath>

#include "proto/frame/time.hpp"

namespace posed::drivers {
namespace {

constexpr double kMinPeriod_ns = 1'000.0;
constexpr double kMaxPeriod_ns = 3'600e9;

Result<std::int64_t> period_of(const Playback& playback) {
  if (!(playback.rate_hz > 0.0)) return misuse("the frame rate should be more than 0 Hz");
  if (playback.pace == 0.0) return 0;
  const double period_ns = 1e9 / (playback.rate_hz * playback.pace);
  if (playback.pace > 0.0 && period_ns >= kMinPeriod_ns && period_ns <= kMaxPeriod_ns) {
    return std::llround(period_ns);
  }
  return misuse(
      "pace should be 1 for the clip's own speed, 0 for as fast as possible, or a factor that "
      "gives "
      "at most 1000000 frames a second and at least one an hour");
}

}  // namespace

Result<std::unique_ptr<Transport>> FileTransport::open(Chunks chunks, const Playback& playback) {
  const auto period_ns = period_of(playback);
  if (!period_ns) return std::unexpected(period_ns.error());
  if (chunks.count() == 0) return fail("there is nothing to play");
  for (std::size_t i = 0; i < chunks.count(); ++i) {
    if (chunks[i].size() > kMaxChunk) {
      return fail("frame " + std::to_string(i + 1) + " is longer than " +
                  std::to_string(kMaxChunk) + " bytes, so it cannot be played");
    }
  }
  auto transport = std::unique_ptr<FileTransport>(
      new FileTransport(std::move(chunks), *period_ns, playback.loop));
  if (auto ok = transport->timer_.open(); !ok) return std::unexpected(ok.error());
  return transport;
}

Result<> FileTransport::start(std::int64_t now_ns) {
  // A timer that fell due and is never read stays readable: the daemon asks again at once.
  timer_.every(now_ns, period_ns_);
  return {};
}

// RT-safe.
bool FileTransport::take_due() noexcept {
  if (period_ns_ == 0) {
    gave_ = !gave_;  // one chunk a wake-up, so that other devices get their turn
    return gave_;
  }
  if (due_ == 0) due_ = timer_.expirations();
  if (due_ == 0) return false;
  --due_;
  return true;
}

// RT-safe.
Chunk FileTransport::read(std::int64_t /*now_ns*/) noexcept {
  if (next_ == chunks_.count()) {
    if (!loop_) return {.bytes = {}, .end = true};
    next_ = 0;
  }
  if (!take_due()) return {};
  return {.bytes = chunks_[next_++], .end = false};
}

}  // namespace posed::drivers
