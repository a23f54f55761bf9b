#include "drivers/transport/file.hpp"

#include <cmath>

namespace posed::drivers {
namespace {

constexpr double kMinPeriod_ns = 1'000.0;
constexpr double kMaxPeriod_ns = 3'600e9;

Result<double> period_of(const PlaybackOptions& options) {
  if (!(options.rate_hz > 0.0)) return misuse("the frame rate should be more than 0 Hz");
  if (options.pace == 0.0) return 0.0;
  const double period_ns = 1e9 / (options.rate_hz * options.pace);
  if (options.pace > 0.0 && period_ns >= kMinPeriod_ns && period_ns <= kMaxPeriod_ns) {
    return period_ns;
  }
  return misuse(
      "pace should be 1 for the clip's own speed, 0 for as fast as possible, or a factor that "
      "gives "
      "at most 1000000 frames a second and at least one an hour");
}

}  // namespace

Result<std::unique_ptr<Transport>> FileTransport::open(Chunks chunks,
                                                       const PlaybackOptions& options) {
  const auto period_ns = TRY(period_of(options));
  if (chunks.count() <= options.again_from) return fail("there is nothing to play");
  for (std::size_t i = 0; i < chunks.count(); ++i) {
    if (chunks[i].size() > kMaxChunk) {
      return fail("frame " + std::to_string(i + 1) + " is longer than " +
                  std::to_string(kMaxChunk) + " bytes, so it cannot be played");
    }
  }
  return std::unique_ptr<Transport>(new FileTransport(std::move(chunks), period_ns, options));
}

FileTransport::FileTransport(Chunks chunks, double period_ns, const PlaybackOptions& options)
    : chunks_(std::move(chunks)),
      period_ns_(period_ns),
      loop_(options.loop),
      again_from_(options.again_from) {
  if (options.pace == 0.0 || options.time_s.size() != chunks_.count()) return;
  const double begin_s = options.time_s.front();
  for (const double t : options.time_s) due_ns_.push_back((t - begin_s) * 1e9 / options.pace);
  round_ns_ = due_ns_.back() + period_ns_ - due_ns_[again_from_];
}

Result<> FileTransport::start(std::int64_t now_ns) {
  start_ns_ = now_ns;
  return {};
}

RT_SAFE std::int64_t FileTransport::next_due_ns() const noexcept {
  if (due_ns_.empty()) return start_ns_ + std::llround(static_cast<double>(given_) * period_ns_);
  const std::size_t again = due_ns_.size() - again_from_;  // chunks of a later loop
  const std::uint64_t round = given_ < due_ns_.size() ? 0 : (given_ - again_from_) / again;
  return start_ns_ + std::llround(static_cast<double>(round) * round_ns_ + due_ns_[index()]);
}

RT_SAFE std::size_t FileTransport::index() const noexcept {
  if (given_ < chunks_.count()) return given_;
  return again_from_ + (given_ - again_from_) % (chunks_.count() - again_from_);
}

RT_SAFE Chunk FileTransport::read(std::int64_t now_ns) noexcept {
  if (!loop_ && given_ == chunks_.count()) return {.bytes = {}, .end = true};
  if (now_ns < next_due_ns()) return {};
  const std::size_t next = index();
  ++given_;
  return {.bytes = chunks_[next], .end = false};
}

}  // namespace posed::drivers
