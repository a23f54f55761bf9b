#include "daemon/tools/logs/missing_from_log.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/run/no_body.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

void add_gaps(const log::Reader& reader, std::vector<std::string>& missing) {
  constexpr std::array<const char*, 3> kNames{"chunks", "decisions", "published frames"};
  const auto gaps = reader.gaps();
  if (!gaps) return;  // cannot happen: open() has read the gaps already
  for (const log::GapRow& gap : *gaps) {
    const bool chunks = gap.kind == log::GapRow::Kind::kChunks;
    const auto owner =
        chunks ? std::ranges::find(reader.sources(), gap.owner, &log::SourceRow::id)->name
               : reader.streams()[*reader.place_of_stream(gap.owner)].name;
    const auto kind = std::min<std::size_t>(static_cast<std::size_t>(gap.kind), 2);
    missing.push_back(fmt::format("{} {}: the log lacks {} {} after chunk {}",
                                  chunks ? "source" : "stream", owner, gap.lost, kNames[kind],
                                  gap.after_chunk));
  }
}

void add_undescribed(const replay::Replay& replay, std::vector<std::string>& missing) {
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const replay::ReplayStream& stream = replay.stream(id);
    if (stream.described) continue;
    missing.push_back(
        fmt::format("stream {}: the log lacks the description of {}'s body {}, so nothing of it is"
                    " replayed",
                    clean_name(stream.name), clean_name(stream.source), clean_name(stream.body)));
  }
}

void add_without_body(const log::Reader& reader, std::vector<std::string>& missing) {
  for (const log::SourceRow& source : reader.sources()) {
    const auto& streams = reader.streams();
    if (std::ranges::find(streams, source.id, &log::StreamRow::source) == streams.end()) {
      missing.push_back(no_body_of(source.name));
    }
  }
}

}  // namespace

std::vector<std::string> missing_from(const log::Reader& reader, const replay::Replay& replay) {
  std::vector<std::string> missing;
  add_gaps(reader, missing);
  add_undescribed(replay, missing);
  add_without_body(reader, missing);
  return missing;
}

}  // namespace posed::tools
