#include "daemon/tools/export/log_takes.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include "daemon/pipeline/take.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

constexpr std::size_t kMostListed = 20;  // takes in a sentence

std::string list_of(const std::vector<log::TakeRow>& takes) {
  std::string list;
  for (std::size_t i = 0; i < takes.size() && i < kMostListed; ++i) {
    const pipeline::Take take{.number = static_cast<std::uint32_t>(takes[i].id),
                              .name = takes[i].name};
    list += (i == 0 ? "" : ", ") + pipeline::words_of(take);
  }
  if (takes.size() > kMostListed) {
    list += " and " + std::to_string(takes.size() - kMostListed) + " more";
  }
  return list;
}

// Finds between which items the chunks came that a log lacks, and marks the takes that were running
// then. A gap lies between two chunks of one source; the items in between are other sources'.
class GapMarker {
 public:
  GapMarker(const std::vector<log::GapRow>& gaps, std::vector<LoggedTake>& takes) : takes_(takes) {
    for (const log::GapRow& gap : gaps) {
      if (gap.kind != log::GapRow::Kind::kChunks) continue;
      if (gap.after_chunk == 0) {
        open_[gap.owner] = 0;
      } else {
        after_[gap.after_chunk] = gap.owner;
      }
    }
  }
  // In the order of the log.
  void on_chunk(const log::ChunkRow& row) {
    if (const auto open = open_.find(row.source); open != open_.end()) {
      mark(open->second, row.first_item);
      open_.erase(open);
    }
    if (after_.contains(row.id)) open_[row.source] = row.first_item;
  }
  void on_end() {
    for (const auto& [source, item] : open_) mark(item, log::kToTheEnd);
  }

 private:
  void mark(std::uint64_t before, std::uint64_t after) {
    for (LoggedTake& take : takes_) {
      const bool overlaps = take.row.first_item < after && take.row.last_item > before;
      if (overlaps) take.has_gaps = true;
    }
  }
  std::vector<LoggedTake>& takes_;
  std::map<std::int64_t, std::uint32_t> after_;  // chunk before a gap -> its source
  std::map<std::uint32_t, std::uint64_t> open_;  // source -> the last item before its gap
};

}  // namespace

Result<log::TakeRow> find_take(const log::Reader& reader, const std::string& wanted) {
  auto takes = reader.takes();
  if (!takes) return std::unexpected(takes.error());
  if (takes->empty()) return misuse("has no takes; leave --take out", reader.file());
  for (const log::TakeRow& take : *takes) {
    if (std::to_string(take.id) == wanted) return take;
  }
  std::vector<log::TakeRow> named;
  std::ranges::copy_if(*takes, std::back_inserter(named),
                       [&](const log::TakeRow& take) { return take.name == wanted; });
  if (named.size() == 1) return named.front();
  if (named.empty()) {
    return misuse("has no take " + in_quotes(wanted) + ", but " + list_of(*takes), reader.file());
  }
  return misuse("has several takes named " + in_quotes(wanted) +
                    "; give the number of one: " + list_of(named),
                reader.file());
}

Result<std::vector<LoggedTake>> logged_takes(log::Reader& reader) {
  auto rows = reader.takes();
  if (!rows) return std::unexpected(rows.error());
  std::vector<LoggedTake> takes;
  for (log::TakeRow& row : *rows) takes.push_back({.row = std::move(row)});
  const auto extent = reader.extent();
  if (!extent) return std::unexpected(extent.error());
  if (takes.empty() || !*extent) return takes;
  const auto gaps = reader.gaps();
  if (!gaps) return std::unexpected(gaps.error());
  GapMarker gap_marker(*gaps, takes);
  for (auto chunk = reader.next_chunk();; chunk = reader.next_chunk()) {
    if (!chunk) return std::unexpected(chunk.error());
    if (!chunk->has_value()) break;
    const log::ChunkRow& row = **chunk;
    gap_marker.on_chunk(row);
    if (row.direction != 0) continue;  // the others have no time of their own
    const double time_s = seconds(row.arrival_ns - (*extent)->first_ns);
    for (LoggedTake& take : takes) {
      if (!holds(take.row, row.first_item)) continue;
      if (!take.begin_s) take.begin_s = time_s;
      take.end_s = time_s;
    }
  }
  gap_marker.on_end();
  return takes;
}

}  // namespace posed::replay
