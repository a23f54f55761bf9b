// What a publisher or a file needs to know of a replayed stream. Cold.
#pragma once

#include <cstdint>

#include "daemon/publish/publisher.hpp"
#include "daemon/tools/replay/replay.hpp"

namespace posed::replay {

// Without counters, source and body.
[[nodiscard]] inline publish::StreamInfo stream_info(std::uint32_t id, const ReplayStream& stream) {
  return {.stream = id,
          .name = stream.name,
          .description = stream.description,
          .skeleton = stream.published,
          .rate_hz = stream.settings.rate_hz,
          .stages = publish::stage_infos(stream.settings),
          .raw = stream.settings.publish_raw};
}

}  // namespace posed::replay
