// Turns a whole device log into an MCAP file: replays it and writes what the run published. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::replay {

struct McapSummary {
  std::uint64_t messages = 0;
  std::size_t topics = 0;
  std::vector<std::string> warnings;  // one sentence for each thing that the file lacks
};

// Writes pose/<stream>, skeleton/<stream>, sensor/<stream> and event/<stream> of every stream, in
// the order in which they were published, as protobuf messages whose schema is in the file. The
// time of a message is its arrival or that of the event, in UTC if the log knows how its clock
// relates to it. A pose that was repeated while its stream was stale is left out, and so are events
// that no pipeline made: takes, devices that come and go, the recorder's own. Frames go to the file
// as they are computed, so the memory does not grow with the log. `stop` is asked before each chunk
// of the log; true ends the writing with an error and without a file.
[[nodiscard]] Result<McapSummary> write_mcap(const std::filesystem::path& log,
                                             const std::filesystem::path& path,
                                             const std::function<bool()>& stop);

}  // namespace posed::replay
