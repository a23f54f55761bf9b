#include "daemon/pipeline/stream_settings.hpp"

#include <utility>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::pipeline {

EngineOptions engine_options(std::uint32_t stream, const StreamSettings& settings,
                             std::shared_ptr<const Skeleton> skeleton) {
  const bool hand = skeleton && hand_side(*skeleton).has_value();
  return {.stream = stream,
          .stale_after_ns = nanoseconds(settings.stale_after_s),
          .publish_raw = settings.publish_raw,
          .style = settings.style,
          .generate = settings.generate,
          .constrain = settings.constrain && hand,
          .rate_hz = settings.rate_hz,
          .skeleton = std::move(skeleton)};
}

}  // namespace posed::pipeline
