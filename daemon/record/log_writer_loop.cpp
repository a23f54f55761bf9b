#include "daemon/record/log_writer_loop.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/record/decision_code.hpp"

namespace posed::record {
namespace {

constexpr std::int64_t kCommitEvery_ns = 250'000'000;
constexpr std::int64_t kFirstRetry_ns = 1'000'000'000;
constexpr std::int64_t kLastRetry_ns = 16'000'000'000;

constexpr std::array<const char*, 3> kKindNames{"chunks", "decisions", "published frames"};

const char* name_of(log::GapRow::Kind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

}  // namespace

LogWriterLoop::LogWriterLoop(RecordRings& rings, log::Writer writer, std::filesystem::path path,
                             std::function<void(const RecorderEvent&)> report)
    : rings_(rings),
      writer_(std::move(writer)),
      path_(std::move(path)),
      report_(std::move(report)),
      sources_(rings.sources()) {
  for (std::uint32_t number = 0; number < sources_.size(); ++number) {
    sources_[number].chunks = {
        .owner = number, .source = number, .in_rings = &rings_.losses_of_source(number)};
  }
}

void LogWriterLoop::turn(std::int64_t now_ns) {
  if (!writer_.is_open() && now_ns >= retry_ns_) resume(now_ns);
  drain(now_ns);
  report_overflows(now_ns);
  if (writer_.is_open() && now_ns - last_commit_ns_ >= kCommitEvery_ns) {
    if (auto done = commit(now_ns); !done) fail(done.error(), now_ns);
  }
  rings_.set_state({.trouble = trouble_, .lost_chunks = lost_chunks()});
}

// Empties the rings against the direction of the data: frames first, chunks last. So whenever the
// process is killed, a frame is in the log only together with the decisions and the chunks that
// made it.
void LogWriterLoop::drain(std::int64_t now_ns) {
  rings_.drain_frames([&](const FrameHeader& header, std::span<const std::byte> bytes) {
    put_frame(header, bytes, now_ns);
  });
  rings_.drain_decisions([&](const DecisionRecord& record) { put_decision(record, now_ns); });
  rings_.drain_chunks(
      [&](const ChunkHeader& header, std::span<const pipeline::StreamPosition> positions,
          std::span<const std::byte> bytes) { put_chunk(header, positions, bytes, now_ns); });
  for (auto& model : rings_.next_models()) models_.push_back(std::move(model));
  add_streams();  // also those all of whose records were lost
  add_takes();
}

void LogWriterLoop::add_streams() {
  for (RecordedStream& stream : rings_.next_streams()) add_stream(std::move(stream));
}

// A take's row waits for the next commit that works, so a full disk costs no take.
void LogWriterLoop::add_takes() {
  for (TakeChange& change : rings_.next_takes()) {
    spdlog::info("{}", change.text);
    report_({.kind = RecorderEvent::Kind::kTake,
             .streams = streams_now(),
             .time_ns = change.time_ns,
             .text = std::move(change.text),
             .take = change.row});
    takes_.insert_or_assign(change.row.id, std::move(change.row));
  }
}

std::vector<std::uint32_t> LogWriterLoop::streams_now() const {
  std::vector<std::uint32_t> streams;
  for (const SourceState& source : sources_) {
    streams.insert(streams.end(), source.streams.begin(), source.streams.end());
  }
  return streams;
}

void LogWriterLoop::add_stream(RecordedStream row) {
  const StreamLosses* losses = rings_.losses_of(row.id);
  if (losses == nullptr || row.source >= sources_.size()) return;
  const Tally tally{.owner = row.id, .source = row.source};
  const auto [at, is_new] = streams_.try_emplace(row.id);
  if (!is_new) return;
  StreamState& stream = at->second;
  stream.decisions = stream.frames = tally;
  stream.decisions.kind = GapKind::kDecisions;
  stream.decisions.in_rings = &losses->decisions;
  stream.frames.kind = GapKind::kFrames;
  stream.frames.in_rings = &losses->frames;
  if (row.from_start) {
    stream.named = true;
    stream.first_item = 1;
    auto& now = sources_[row.source].streams;  // what the first chunk will say
    if (now.empty()) now.push_back(row.id);
  }
  stream.row = std::move(row);
}

LogWriterLoop::StreamState* LogWriterLoop::meet(std::uint32_t id, std::uint64_t item) {
  auto at = streams_.find(id);
  if (at == streams_.end()) {
    add_streams();
    at = streams_.find(id);
  }
  if (at == streams_.end()) return nullptr;
  StreamState& stream = at->second;
  stream.named = true;
  if (item != 0 && (stream.first_item == 0 || item < stream.first_item)) stream.first_item = item;
  return &stream;
}

template <typename Row>
bool LogWriterLoop::put(Tally& tally, const Row& row, std::int64_t now_ns) {
  if (writer_.is_open()) {
    auto done = writer_.add(row);
    if (done) {
      ++tally.uncommitted;
      return true;
    }
    fail(done.error(), now_ns);
  }
  count_lost(tally, 1);
  return false;
}

void LogWriterLoop::put_chunk(const ChunkHeader& header,
                              std::span<const pipeline::StreamPosition> positions,
                              std::span<const std::byte> bytes, std::int64_t now_ns) {
  SourceState& source = sources_[header.source];
  put_gap(source.chunks, header.lost_before, now_ns);
  places_.clear();
  for (const pipeline::StreamPosition& next : positions) {
    places_.push_back({next.stream, next.frame, next.sample});
  }
  if (!std::ranges::equal(source.streams, positions, {}, {}, &pipeline::StreamPosition::stream)) {
    source.streams.clear();
    for (const pipeline::StreamPosition& next : positions) {
      source.streams.push_back(next.stream);
      meet(next.stream, header.item);
    }
  }
  const log::ChunkRow row{.source = header.source,
                          .socket = header.socket,
                          .direction = static_cast<std::uint8_t>(header.direction),
                          .arrival_ns = header.arrival_ns,
                          .first_item = header.item,
                          .places = places_,
                          .bytes = bytes};
  if (put(source.chunks, row, now_ns)) source.last_chunk = writer_.last_chunk_id();
}

void LogWriterLoop::put_decision(const DecisionRecord& record, std::int64_t now_ns) {
  StreamState* stream = meet(record.decision.stream, record.decision.item);
  if (stream == nullptr) return;
  Tally& tally = stream->decisions;
  put_gap(tally, record.lost_before, now_ns, record.lost_from_frame);
  const bool written = put(tally, row_of(record.decision), now_ns);
  auto& from = written ? tally.uncommitted_from_frame : tally.lost_from_frame;
  from = std::min(from, first_frame_of(record.decision));
}

void LogWriterLoop::put_frame(const FrameHeader& header, std::span<const std::byte> bytes,
                              std::int64_t now_ns) {
  StreamState* stream = meet(header.stream, 0);
  if (stream == nullptr) return;
  put_gap(stream->frames, header.lost_before, now_ns);
  put(stream->frames, log::FrameRow{header.stream, header.sequence, header.raw, bytes}, now_ns);
}

void LogWriterLoop::put_gap(Tally& tally, std::uint64_t lost, std::int64_t now_ns,
                            std::uint64_t from_frame) {
  if (lost == 0) return;
  if (tally.kind != GapKind::kChunks) meet(tally.owner, 0);
  if (writer_.is_open()) {
    const auto row = gap_row(tally, lost, now_ns, from_frame);
    auto done = row ? writer_.add(*row) : std::unexpected(row.error());
    if (done) {
      tally.in_gaps += lost;
      tally.uncommitted_from_frame = std::min(tally.uncommitted_from_frame, from_frame);
      return;
    }
    fail(done.error(), now_ns);
  }
  tally.lost += lost;  // the rings have counted them already
  tally.lost_from_frame = std::min(tally.lost_from_frame, from_frame);
}

// Decisions arrive later than the chunks that they concern: if some are lost, the log is reliable
// only up to the chunk before.
Result<log::GapRow> LogWriterLoop::gap_row(const Tally& tally, std::uint64_t lost,
                                           std::int64_t now_ns, std::uint64_t from_frame) const {
  log::GapRow row{tally.kind, tally.owner, sources_[tally.source].last_chunk, lost, now_ns};
  if (tally.kind != GapKind::kDecisions || from_frame == kNoFrame) return row;
  row.after_chunk = TRY(writer_.chunk_before_frame(tally.source, tally.owner, from_frame));
  return row;
}

// Just before each commit: all rows of one commit come into the log together, and by then the chunk
// that a frame was made from has said from which item on its stream is there.
Result<> LogWriterLoop::write_stream_rows() {
  for (const auto& [id, stream] : streams_) {
    if (!stream.named || !stream.row) continue;
    TRY(add_stream_row(writer_, *stream.row, stream.first_item));
  }
  return {};
}

Result<> LogWriterLoop::commit(std::int64_t now_ns) {
  if (!writer_.is_in_place()) {
    return posed::fail(
        "the log was deleted, moved or replaced, or cut short, while it was written; put it back,"
        " or end the recording and begin another",
        path_.string());
  }
  for (const auto& model : models_) {
    TRY(writer_.add_blob(model));
  }
  for (const auto& [number, take] : takes_) {
    TRY(writer_.add(take));
  }
  TRY(write_stream_rows());
  TRY(writer_.commit());
  models_.clear();
  takes_.clear();
  for (SourceState& source : sources_) source.committed_chunk = source.last_chunk;
  for (auto& [id, stream] : streams_) {
    if (stream.named) stream.row.reset();
  }
  each_tally([](Tally& tally) {
    tally.uncommitted = tally.in_gaps = 0;
    tally.uncommitted_from_frame = kNoFrame;
  });
  last_commit_ns_ = now_ns;
  return {};
}

Result<> LogWriterLoop::finish(std::int64_t now_ns) {
  if (!writer_.is_open()) resume(now_ns);
  drain(now_ns);
  report_overflows(now_ns);
  each_tally([&](Tally& tally) {
    put_gap(tally, tally.in_rings->pending(), now_ns,
            tally.kind == GapKind::kDecisions ? tally.in_rings->lost_from_frame.load() : kNoFrame);
  });
  if (writer_.is_open()) {
    if (auto done = commit(now_ns); !done) fail(done.error(), now_ns);
  }
  if (!writer_.is_open()) {
    return posed::fail(
        "recording could not be finished; the log ends at the last commit (" + trouble_ + ")",
        path_.string());
  }
  auto closed = writer_.close();
  if (!closed) ++errors_;  // so that nobody is told that nothing is missing
  return closed;
}

void LogWriterLoop::count_lost(Tally& tally, std::uint64_t count) {
  tally.lost += count;
  if (tally.kind == GapKind::kChunks) lost_to_errors_ += count;
  if (tally.kind == GapKind::kFrames) lost_frames_ += count;
}

// Everything written since the last commit is lost.
void LogWriterLoop::fail(const Error& error, std::int64_t now_ns) {
  writer_.interrupt();
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
  for (SourceState& source : sources_) source.last_chunk = source.committed_chunk;
  failed(error, now_ns);
}

// Counts an attempt to write that has failed, and says the first one.
void LogWriterLoop::failed(const Error& error, std::int64_t now_ns) {
  ++errors_;
  error_ns_ = now_ns;
  const bool is_known = !trouble_.empty();
  trouble_ = error.text();
  if (is_known) return;
  const RecorderEvent event{.kind = RecorderEvent::Kind::kError,
                            .streams = streams_now(),
                            .time_ns = now_ns,
                            .text = "recording stopped, streaming continues: " + trouble_};
  spdlog::error("{}", event.text);
  report_(event);
}

// Tries to write the gap rows for what is missing; recording continues only after that has worked.
void LogWriterLoop::resume(std::int64_t now_ns) {
  if (retry_after_ns_ == 0) retry_after_ns_ = kFirstRetry_ns;  // it was never begun
  retry_ns_ = now_ns + retry_after_ns_;
  auto done = writer_.resume();
  if (done) done = write_lost(now_ns);
  if (done) done = commit(now_ns);
  if (!done) {
    writer_.interrupt();
    return failed(done.error(), now_ns);
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
    done = row ? writer_.add(*row) : std::unexpected(row.error());
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
