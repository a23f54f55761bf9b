// The stream of a device with one body, with its device open and its model files loaded: `run`
// starts from it, and `check` tries it.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

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

// Opens the source and loads the stages, which may name `partners`. Errors name the stream. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenStream>> open_stream(
    const config::StreamConfig& config, const pipeline::PartnerStreams& partners = {});

// The order in which to open the streams: those whose stages name others come after these.
[[nodiscard]] std::vector<std::size_t> opening_order(
    const std::vector<config::StreamConfig>& streams);
// From now on the stages of other streams can have this one, stream number `number`, as a partner;
// unless it has partners itself.
void add_partner(pipeline::PartnerStreams& partners, std::size_t number, const OpenStream& stream);

}  // namespace posed::devices
