// Clips and takes of a device log: replays the frames that the run published. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/rows.hpp"

namespace posed::tools {

struct LoggedTake {
  log::TakeRow row{};
  // Arrival of its first and its last chunk, after that of the log's first; empty: it has none.
  std::optional<double> begin_s{};
  std::optional<double> end_s{};
  bool has_gaps = false;  // the log lacks chunks that came during the take
};

// Reads through all chunks of the log.
Result<std::vector<LoggedTake>> logged_takes(log::Reader& reader);

// `wanted` is a take's number, or its name if no other take has it. Otherwise the error lists the
// takes that there are.
Result<log::TakeRow> find_take(const log::Reader& reader, const std::string& wanted);

[[nodiscard]] constexpr bool holds(const log::TakeRow& take, std::uint64_t item) noexcept {
  return item >= take.first_item && item <= take.last_item;
}

// The stream named `stream`; the only one if that is empty. A body that came several times has
// several parts, which become one clip; "walker#2" is the second part alone, for a body that
// changed its skeleton. With `raw`, and as "walker-raw", it is the motion before its stages,
// whether or not that was published. Times are those of the device if it has them, otherwise those
// of arrival, starting from 0. `take`: only what was published during this take of the log, by its
// number or its name; empty: all. `warnings` describes what the log or the run left out.
Result<clip::Clip> clip_of_log(const std::filesystem::path& path, const std::string& stream,
                               const std::string& take = {}, bool raw = false);

[[nodiscard]] inline bool is_log(const std::filesystem::path& path) {
  return clip::extension_of(path) == ".plog";
}

// Refuses what has no effect for `in`: a stream or a take of a clip, the figure of a log.
Result<> check_log_options(const std::string& in, bool part_given, const clip::ReadOptions& read);

// `stream`: its name, with "#2" behind it for a part with a skeleton of its own.
using EachTakeClip =
    std::function<void(const log::TakeRow& take, const std::string& stream, Result<clip::Clip>)>;

// Calls `each` with the clip of each take and stream, in the order of the takes; one replay of the
// log makes them all, with the frames of one take in memory. Streams with fewer than two frames in
// a take are left out. Ends with an error when `goes_on` says no.
Result<> each_take_clip(const std::filesystem::path& path, const EachTakeClip& each,
                        const std::function<bool()>& goes_on);

}  // namespace posed::tools
