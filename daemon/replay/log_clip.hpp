// Turns a stream of a device log into a clip: replays the frames that the run published. Cold.
#pragma once

#include <filesystem>
#include <string>

#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::replay {

// The stream named `stream`; the only one if that is empty. A body that came several times has
// several parts, which become one clip; "walker#2" is the second part alone, for a body that
// changed its skeleton. Times are those of the device if it has them, otherwise those of arrival,
// starting from 0. `warnings` describes what the log or the run left out.
[[nodiscard]] Result<clip::Clip> clip_of_log(const std::filesystem::path& path,
                                             const std::string& stream);

}  // namespace posed::replay
