// The part of LogWriterLoop for what the log lacks: counting, reporting and trying again.
#include <algorithm>
#include <array>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/record/log_writer_loop.hpp"

namespace posed::record {
namespace {

constexpr std::int64_t kFirstRetry_ns = 1'000'000'000;
constexpr std::int64_t kLastRetry_ns = 16'000'000'000;

constexpr std::array<const char*, 3> kKindNames{"chunks", "decisions", "published frames"};

const char* name_of(log::GapRow::Kind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

}  // namespace

void LogWriterLoop::count_lost(Tally& tally, std::uint64_t count) {
  tally.lost += count;
  if (tally.kind == GapKind::kChunks) lost_to_errors_ += count;
  if (tally.kind == GapKind::kFrames) lost_frames_ += count;
}

// Everything written since the last commit is lost. The writer is closed, too, because after an I/O
// error only a new connection is known to be in a valid state.
void LogWriterLoop::fail(const Error& error, std::int64_t now_ns) {
  writer_->rollback();
  writer_.reset();
  trouble_ = error.text();
  ++errors_;
  error_ns_ = now_ns;
  // An almost full disk accepts a little now and then, so try again less and less often.
  const bool held_long = now_ns - resumed_ns_ > kLastRetry_ns;
  retry_after_ns_ = held_long ? kFirstRetry_ns : std::min(2 * retry_after_ns_, kLastRetry_ns);
  retry_ns_ = now_ns + retry_after_ns_;
  each_tally([&](Tally& tally) {
    count_lost(tally, std::exchange(tally.uncommitted, 0));
    tally.lost += std::exchange(tally.in_gaps, 0);
    tally.lost_from_frame =
        std::min(tally.lost_from_frame, std::exchange(tally.uncommitted_from_frame, kNoFrame));
  });
  const RecorderEvent event{.kind = RecorderEvent::Kind::kError,
                            .streams = streams_now(),
                            .time_ns = now_ns,
                            .text = "recording stopped, streaming continues: " + error.text()};
  for (SourceState& source : sources_) source.last_chunk = source.committed_chunk;
  spdlog::error("{}", event.text);
  report_(event);
}

// Tries to write the gap rows for what is missing; recording continues only after that has worked.
void LogWriterLoop::resume(std::int64_t now_ns) {
  retry_ns_ = now_ns + retry_after_ns_;
  auto writer = log::Writer::reopen(path_);
  if (!writer) {
    ++errors_;
    error_ns_ = now_ns;
    return;
  }
  writer_ = std::move(*writer);
  auto done = write_lost(now_ns);
  if (done) done = commit(now_ns);
  if (!done) {
    writer_.reset();
    ++errors_;
    error_ns_ = now_ns;
    return;
  }
  trouble_.clear();
  resumed_ns_ = now_ns;
  spdlog::warn("recording continues: {}", path_.string());
  each_tally([&](Tally& tally) {
    tally.lost_from_frame = kNoFrame;
    const std::uint64_t lost = std::exchange(tally.lost, 0);
    if (lost == 0) return;
    report_gap(tally, now_ns,
               "the log lacks " + std::to_string(lost) + " " + name_of(tally.kind) +
                   " from while it could not be written");
  });
}

Result<> LogWriterLoop::write_lost(std::int64_t now_ns) {
  Result<> done;
  each_tally([&](const Tally& tally) {
    if (tally.lost == 0 || !done) return;
    const auto row = gap_row(tally, tally.lost, now_ns, tally.lost_from_frame);
    done = row ? writer_->add(*row) : std::unexpected(row.error());
  });
  return done;
}

void LogWriterLoop::report_overflows(std::int64_t now_ns) {
  each_tally([&](Tally& tally) {
    const std::uint64_t total = tally.in_rings->total.load(std::memory_order_relaxed);
    const std::uint64_t news = total - std::exchange(tally.reported, total);
    if (news == 0) return;
    if (tally.kind == GapKind::kFrames) lost_frames_ += news;
    const std::string text = "the recorder's ring was full: the log lacks " + std::to_string(news) +
                             " " + name_of(tally.kind);
    spdlog::warn("{}", text);
    report_gap(tally, now_ns, text);
  });
}

void LogWriterLoop::report_gap(const Tally& tally, std::int64_t now_ns, const std::string& text) {
  RecorderEvent event{
      .kind = RecorderEvent::Kind::kGap, .streams = {tally.owner}, .time_ns = now_ns, .text = text};
  if (tally.kind == GapKind::kChunks) event.streams = sources_[tally.source].streams;
  report_(event);
}

std::uint64_t LogWriterLoop::lost_chunks() const noexcept {
  std::uint64_t lost = lost_to_errors_.load();
  for (std::uint32_t source = 0; source < rings_.sources(); ++source) {
    lost += rings_.losses_of_source(source).total.load(std::memory_order_relaxed);
  }
  return lost;
}

}  // namespace posed::record
