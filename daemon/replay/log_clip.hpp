// A device log's stream as a clip: the frames that the run published, replayed. Cold.
#pragma once

#include <filesystem>
#include <string>

#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::replay {

// The stream called `stream`; the only one when that is empty. Times are the device's where it has
// them, else those of arrival, from 0. What the log or the run left out is told in `warnings`.
[[nodiscard]] Result<clip::Clip> clip_of_log(const std::filesystem::path& path,
                                             const std::string& stream);

}  // namespace posed::replay
