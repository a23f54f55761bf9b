#include "daemon/devices/open_stream.hpp"

#include <utility>

#include "daemon/devices/about_stream.hpp"

namespace posed::devices {

Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config) {
  auto source = open_source({.name = config.name,
                             .driver = config.driver,
                             .options = config.options,
                             .calibration = config.calibration});
  if (!source) return of_stream(config.name, source.error());
  const drivers::Description& description = (*source)->device.description;
  ModelFiles files;
  auto stages = load_stages(config, description.skeleton, description.rate_hz, files);
  if (!stages) return of_stream(config.name, stages.error());
  auto stream = std::make_unique<OpenStream>();
  stream->config = config;
  stream->source = std::move(*source);
  stream->stages = std::move(*stages);
  return stream;
}

}  // namespace posed::devices
