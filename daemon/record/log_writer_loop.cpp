#include "daemon/record/log_writer_loop.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/record/decision_code.hpp"

namespace posed::record {
namespace {

constexpr std::int64_t kCommitEvery_ns = 250'000'000;
constexpr std::int64_t kFirstRetry_ns = 1'000'000'000;
constexpr std::int64_t kLastRetry_ns = 16'000'000'000;

constexpr std::array<const char*, 3> kKindNames{"chunks", "decisions", "published frames"};

}  // namespace

LogWriterLoop::LogWriterLoop(RecordRings& rings, log::Writer writer, std::filesystem::path path,
                             std::function<void(const RecorderEvent&)> report)
    : rings_(rings),
      writer_(std::move(writer)),
      path_(std::move(path)),
      report_(std::move(report)),
      streams_(rings.streams()) {}

void LogWriterLoop::turn(std::int64_t now_ns) {
  if (!writer_ && now_ns >= retry_ns_) resume(now_ns);
  drain(now_ns);
  report_overflows(now_ns);
  if (writer_ && now_ns - last_commit_ns_ >= kCommitEvery_ns) {
    if (auto done = commit(now_ns); !done) fail(done.error(), now_ns);
  }
}

// Empties the rings against the direction of the data: frames first, chunks last. So whenever the
// process is killed, a frame is in the log only together with the decisions and the chunks that
// made it.
void LogWriterLoop::drain(std::int64_t now_ns) {
  rings_.drain_frames([&](const FrameHeader& header, std::span<const std::byte> bytes) {
    put_gap(header.stream, GapKind::kFrames, header.lost_before, now_ns);
    const log::FrameRow row{header.stream, header.sequence, header.raw, bytes};
    put(header.stream, GapKind::kFrames, row, now_ns);
  });
  rings_.drain_decisions([&](const DecisionRecord& record) { put_decision(record, now_ns); });
  rings_.drain_chunks([&](const ChunkHeader& header, std::span<const std::byte> bytes) {
    put_gap(header.stream, GapKind::kChunks, header.lost_before, now_ns);
    // Each source has one body.
    const std::array places{
        log::StreamPosition{header.stream, header.next.frame, header.next.sample}};
    const log::ChunkRow row{.source = header.stream,
                            .socket = header.socket,
                            .direction = static_cast<std::uint8_t>(header.direction),
                            .arrival_ns = header.arrival_ns,
                            .first_item = header.next.item,
                            .places = places,
                            .bytes = bytes};
    if (put(header.stream, GapKind::kChunks, row, now_ns)) {
      streams_[header.stream].last_chunk = writer_->last_chunk_id();
    }
  });
  for (auto& model : rings_.take_models()) models_.push_back(std::move(model));
}

template <typename Row>
bool LogWriterLoop::put(std::uint32_t stream, GapKind kind, const Row& row, std::int64_t now_ns) {
  if (writer_) {
    auto done = writer_->add(row);
    if (done) {
      ++streams_[stream].uncommitted[index(kind)];
      return true;
    }
    fail(done.error(), now_ns);
  }
  count_lost(stream, kind, 1);
  return false;
}

void LogWriterLoop::put_decision(const DecisionRecord& record, std::int64_t now_ns) {
  const std::uint32_t id = record.decision.stream;
  put_gap(id, GapKind::kDecisions, record.lost_before, now_ns, record.lost_from_frame);
  StreamState& stream = streams_[id];
  const bool written = put(id, GapKind::kDecisions, row_of(record.decision), now_ns);
  auto& from = written ? stream.uncommitted_from_frame : stream.lost_from_frame;
  from = std::min(from, first_frame_of(record.decision));
}

void LogWriterLoop::put_gap(std::uint32_t id, GapKind kind, std::uint64_t lost, std::int64_t now_ns,
                            std::uint64_t from_frame) {
  if (lost == 0) return;
  StreamState& stream = streams_[id];
  if (writer_) {
    const auto row = gap_row(id, kind, lost, now_ns, from_frame);
    auto done = row ? writer_->add(*row) : std::unexpected(row.error());
    if (done) {
      stream.in_gaps[index(kind)] += lost;
      stream.uncommitted_from_frame = std::min(stream.uncommitted_from_frame, from_frame);
      return;
    }
    fail(done.error(), now_ns);
  }
  stream.lost[index(kind)] += lost;  // the rings have counted them already
  stream.lost_from_frame = std::min(stream.lost_from_frame, from_frame);
}

// Decisions arrive later than the chunks that they concern: if some are lost, the log is reliable
// only up to the chunk before.
Result<log::GapRow> LogWriterLoop::gap_row(std::uint32_t id, GapKind kind, std::uint64_t lost,
                                           std::int64_t now_ns, std::uint64_t from_frame) const {
  log::GapRow row{kind, id, streams_[id].last_chunk, lost, now_ns};
  if (kind != GapKind::kDecisions || from_frame == kNoFrame) return row;
  const auto before = writer_->chunk_before_frame(id, id, from_frame);
  if (!before) return std::unexpected(before.error());
  row.after_chunk = *before;
  return row;
}

Result<> LogWriterLoop::commit(std::int64_t now_ns) {
  for (const auto& model : models_) {
    if (auto kept = writer_->add_blob(model); !kept) return std::unexpected(kept.error());
  }
  if (auto done = writer_->commit(); !done) return done;
  models_.clear();
  for (StreamState& stream : streams_) {
    stream.uncommitted = {};
    stream.in_gaps = {};
    stream.uncommitted_from_frame = kNoFrame;
    stream.committed_chunk = stream.last_chunk;
  }
  last_commit_ns_ = now_ns;
  return {};
}

void LogWriterLoop::count_lost(std::uint32_t stream, GapKind kind, std::uint64_t count) {
  streams_[stream].lost[index(kind)] += count;
  if (kind == GapKind::kChunks) lost_to_errors_ += count;
}

// Everything written since the last commit is lost. The writer is closed, too, because after an I/O
// error only a new connection is known to be in a valid state.
void LogWriterLoop::fail(const Error& error, std::int64_t now_ns) {
  writer_->rollback();
  writer_.reset();
  ++errors_;
  // An almost full disk accepts a little now and then, so try again less and less often.
  const bool held_long = now_ns - resumed_ns_ > kLastRetry_ns;
  retry_after_ns_ = held_long ? kFirstRetry_ns : std::min(2 * retry_after_ns_, kLastRetry_ns);
  retry_ns_ = now_ns + retry_after_ns_;
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    StreamState& stream = streams_[id];
    for (const GapKind kind : kKinds) {
      count_lost(id, kind, std::exchange(stream.uncommitted[index(kind)], 0));
      stream.lost[index(kind)] += std::exchange(stream.in_gaps[index(kind)], 0);
    }
    stream.lost_from_frame =
        std::min(stream.lost_from_frame, std::exchange(stream.uncommitted_from_frame, kNoFrame));
    stream.last_chunk = stream.committed_chunk;
  }
  const std::string text = "recording stopped, streaming continues: " + error.text();
  spdlog::error("{}", text);
  report_({.kind = RecorderEvent::Kind::kError, .stream = 0, .time_ns = now_ns, .text = text});
}

// Tries to write the gap rows for what is missing; recording continues only after that has worked.
void LogWriterLoop::resume(std::int64_t now_ns) {
  retry_ns_ = now_ns + retry_after_ns_;
  auto writer = log::Writer::reopen(path_);
  if (!writer) {
    ++errors_;
    return;
  }
  writer_ = std::move(*writer);
  auto done = write_lost(now_ns);
  if (done) done = commit(now_ns);
  if (!done) {
    writer_.reset();
    ++errors_;
    return;
  }
  resumed_ns_ = now_ns;
  spdlog::warn("recording continues: {}", path_.string());
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    const Counts lost = std::exchange(streams_[id].lost, {});
    streams_[id].lost_from_frame = kNoFrame;
    for (const GapKind kind : kKinds) {
      if (lost[index(kind)] == 0) continue;
      report_({.kind = RecorderEvent::Kind::kGap,
               .stream = id,
               .time_ns = now_ns,
               .text = "the log lacks " + std::to_string(lost[index(kind)]) + " " +
                       kKindNames[index(kind)] + " from while it could not be written"});
    }
  }
}

Result<> LogWriterLoop::write_lost(std::int64_t now_ns) {
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    for (const GapKind kind : kKinds) {
      const std::uint64_t lost = streams_[id].lost[index(kind)];
      if (lost == 0) continue;
      const auto row = gap_row(id, kind, lost, now_ns, streams_[id].lost_from_frame);
      if (!row) return std::unexpected(row.error());
      if (auto done = writer_->add(*row); !done) return done;
    }
  }
  return {};
}

void LogWriterLoop::report_overflows(std::int64_t now_ns) {
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    for (const GapKind kind : kKinds) {
      const std::uint64_t total = rings_.overflowed(id, kind);
      const std::uint64_t news = total - std::exchange(streams_[id].reported[index(kind)], total);
      if (news == 0) continue;
      const std::string text = "the recorder's ring was full: the log lacks " +
                               std::to_string(news) + " " + kKindNames[index(kind)];
      spdlog::warn("{}", text);
      report_({.kind = RecorderEvent::Kind::kGap, .stream = id, .time_ns = now_ns, .text = text});
    }
  }
}

Result<> LogWriterLoop::finish(std::int64_t now_ns) {
  if (!writer_) resume(now_ns);
  drain(now_ns);
  report_overflows(now_ns);
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    for (const GapKind kind : kKinds) {
      put_gap(id, kind, rings_.uncarried(id, kind), now_ns, rings_.uncarried_from_frame(id));
    }
  }
  if (writer_) {
    if (auto done = commit(now_ns); !done) fail(done.error(), now_ns);
  }
  if (!writer_) {
    return posed::fail("recording could not be finished; the log ends at the last commit",
                       path_.string());
  }
  return writer_->close();
}

std::uint64_t LogWriterLoop::lost_chunks() const noexcept {
  std::uint64_t lost = lost_to_errors_.load();
  for (std::uint32_t id = 0; id < streams_.size(); ++id) {
    lost += rings_.overflowed(id, GapKind::kChunks);
  }
  return lost;
}

}  // namespace posed::record
