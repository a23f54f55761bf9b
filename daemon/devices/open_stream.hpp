// The stream of a device with one body, with its device open and its model files loaded: `run`
// starts from it, and `check` tries it.
#pragma once

#include <memory>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_stages.hpp"
#include "daemon/pipeline/counters.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct OpenStream {
  config::StreamConfig config;
  std::unique_ptr<OpenSource> source;  // never null
  LoadedStages stages;
  pipeline::StreamCounters counters;
};

// Opens the source and loads the stages. Errors name the stream. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config);

}  // namespace posed::devices
