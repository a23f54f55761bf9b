#include "daemon/replay/log_takes.hpp"

#include <algorithm>
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
  for (auto chunk = reader.next_chunk();; chunk = reader.next_chunk()) {
    if (!chunk) return std::unexpected(chunk.error());
    if (!chunk->has_value()) return takes;
    const log::ChunkRow& row = **chunk;
    if (row.direction != 0) continue;  // the others have no time of their own
    const double time_s = seconds(row.arrival_ns - (*extent)->first_ns);
    for (LoggedTake& take : takes) {
      if (!holds(take.row, row.first_item)) continue;
      if (!take.begin_s) take.begin_s = time_s;
      take.end_s = time_s;
    }
  }
}

}  // namespace posed::replay
