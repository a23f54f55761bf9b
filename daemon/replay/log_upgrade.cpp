#include "daemon/replay/log_upgrade.hpp"

#include <map>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "daemon/replay/replay.hpp"
#include "proto/log/files.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/writer.hpp"

namespace posed::replay {
namespace {

constexpr std::uint64_t kRowsPerCommit = 10'000;

// Copies the rows of a log. The first error is kept and ends the copying.
class LogCopy {
 public:
  LogCopy(const log::Reader& from, const Replay& replay, log::Writer to)
      : from_(from), replay_(replay), to_(std::move(to)) {}

  void describe() {
    for (const log::SourceRow& row : from_.sources()) add(row);
    for (log::StreamRow row : from_.streams()) {
      row.first_item = 1;  // each source of the older formats had one body from its start
      add(row);
    }
    const auto blobs = from_.blobs();
    if (!blobs) return keep(std::unexpected(blobs.error()));
    for (const std::string& name : *blobs) keep(copy_blob(name));
  }

  void chunk(log::ChunkRow row) {
    log::StreamPosition place = row.places[0];
    place.next_sample = replay_.next_sample(place.stream);
    row.first_item = replay_.next_item();
    row.places = std::span(&place, 1);
    add(row);
    copied_[row.id] = to_.last_chunk_id();
    arrival_ns_[row.source] = row.arrival_ns;
    ++summary_.chunks;
  }

  void decision(log::DecisionRow row, std::uint64_t item) {
    row.item = item;
    add(row);
    ++summary_.decisions;
  }

  // What the older formats imply: every stream ended when its device sent last.
  void end_streams() {
    for (const log::StreamRow& stream : from_.streams()) {
      decision({.stream = stream.id,
                .stage = log::words::kEngine,
                .name = log::words::kEnd,
                .value = {},
                .now_ns = arrival_ns_[stream.source]},
               replay_.next_item());
    }
  }

  void frames_and_gaps() {
    for (const log::StreamRow& stream : from_.streams()) {
      for (const bool raw : {false, true}) frames(stream.id, raw);
    }
    const auto gaps = from_.gaps();
    if (!gaps) return keep(std::unexpected(gaps.error()));
    for (log::GapRow gap : *gaps) {
      const auto after = copied_.upper_bound(gap.after_chunk);
      gap.after_chunk = after == copied_.begin() ? 0 : std::prev(after)->second;
      add(gap);
    }
  }

  [[nodiscard]] Result<UpgradeSummary> close() {
    if (ok_) ok_ = to_.close();
    if (!ok_) return std::unexpected(ok_.error());
    return summary_;
  }
  [[nodiscard]] const Result<>& ok() const { return ok_; }

 private:
  void keep(Result<> done) {
    if (ok_) ok_ = std::move(done);
  }

  Result<> copy_blob(const std::string& name) {
    const auto bytes = from_.blob(name);
    if (!bytes) return std::unexpected(bytes.error());
    const auto added = to_.add_blob(*bytes);
    return added ? Result<>() : std::unexpected(added.error());
  }

  template <typename Row>
  void add(const Row& row) {
    if (!ok_) return;
    ok_ = to_.add(row);
    if (ok_ && ++rows_ % kRowsPerCommit == 0) ok_ = to_.commit();
  }

  void frames(std::uint32_t stream, bool raw) {
    auto rows = from_.frames(stream, raw);
    if (!rows) return keep(std::unexpected(rows.error()));
    while (ok_) {
      const auto row = rows->next();
      if (!row) return keep(std::unexpected(row.error()));
      if (!row->has_value()) return;
      add(**row);
      ++summary_.frames;
    }
  }

  const log::Reader& from_;
  const Replay& replay_;
  log::Writer to_;
  std::map<std::int64_t, std::int64_t> copied_;       // ids of chunks there and here
  std::map<std::uint32_t, std::int64_t> arrival_ns_;  // [source] of its last chunk
  std::uint64_t rows_ = 0;
  UpgradeSummary summary_;
  Result<> ok_;
};

}  // namespace

Result<UpgradeSummary> upgrade_log(const std::filesystem::path& log,
                                   const std::filesystem::path& path,
                                   const std::function<bool()>& stop) {
  auto reader = log::Reader::open(log);
  if (!reader) return std::unexpected(reader.error());
  if (reader->counts_items()) {
    return fail("has the format that this posed writes; there is nothing to upgrade", log.string());
  }
  auto replay = Replay::open(*reader);
  if (!replay) return std::unexpected(replay.error());
  const std::filesystem::path part = path.string() + ".part";
  auto writer = log::Writer::create(part, reader->meta(), true);
  if (!writer) return std::unexpected(writer.error());
  bool stopped = false;
  const auto upgraded = [&]() -> Result<UpgradeSummary> {
    LogCopy copy(*reader, **replay, std::move(*writer));
    copy.describe();
    (*replay)->watch_decisions(
        [&](const log::DecisionRow& row, std::uint64_t item) { copy.decision(row, item); });
    const auto replayed = (*replay)->run([](const pipeline::Item&) {},
                                         [&](const log::ChunkRow& row) {
                                           copy.chunk(row);
                                           stopped = stop();
                                           return copy.ok().has_value() && !stopped;
                                         });
    if (!replayed) return std::unexpected(replayed.error());
    if (stopped) return fail("was not written: interrupted", path.string());
    copy.end_streams();
    copy.frames_and_gaps();
    return copy.close();
  }();
  std::error_code failed;
  if (upgraded) std::filesystem::rename(part, path, failed);
  if (upgraded && !failed) return upgraded;
  std::error_code ignored;
  for (const char* suffix : log::kFileSuffixes) {
    std::filesystem::remove(part.string() + suffix, ignored);
  }
  if (!upgraded) return upgraded;
  return fail("cannot be written: " + failed.message(), path.string());
}

}  // namespace posed::replay
