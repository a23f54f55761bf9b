// Clips and takes of a device log: replays the frames that the run published. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/format.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/frame/timecode.hpp"
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
using EachClip = std::function<void(const std::string& stream, Result<clip::Clip>)>;

// Calls `each` with the clip of each stream of the take; one replay of the log up to the take's end
// makes them all, with its frames in memory. Streams with fewer than two frames in it are left out.
// Fails while the log does not have the take's end, and when `goes_on` says no.
Result<> each_clip_of_take(const std::filesystem::path& path, const log::TakeRow& take,
                           const EachClip& each, const std::function<bool()>& goes_on);

// Collects the frames of a stream's parts as they were published, each once.
class FrameCollector {
 public:
  explicit FrameCollector(const std::shared_ptr<const Skeleton>& skeleton) : clip_(skeleton) {}

  // `timecode` is that of the moment, for frames that have none of their own; empty: not known.
  void add(const Frame& frame, const Timecode& timecode = {});
  [[nodiscard]] std::size_t frames() const { return times_.size(); }
  // Fails with fewer than two frames. `path`: for the words of an error.
  Result<clip::Clip> finish(const std::string& path, double rate_hz) const;

 private:
  clip::FramesClip clip_;
  std::uint32_t part_ = pipeline::kNoStream;
  std::uint64_t last_ = 0, missing_ = 0, returns_ = 0;
  clip::FrameTimes times_;
  Timecode moment_{};  // of the next frame
};

}  // namespace posed::tools
