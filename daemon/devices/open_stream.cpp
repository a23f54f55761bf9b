#include "daemon/devices/open_stream.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "daemon/devices/about_stream.hpp"

namespace posed::devices {

namespace {

bool names_partners(const config::StreamConfig& stream) {
  return std::ranges::any_of(stream.stages, [](const config::StageConfig& stage) {
    return !stage.type->partners.empty();
  });
}

}  // namespace

Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config,
                                                const pipeline::PartnerStreams& partners) {
  auto source = open_source({.name = config.name,
                             .driver = config.driver,
                             .options = config.options,
                             .calibration = config.calibration});
  if (!source) return of_stream(config.name, source.error());
  const drivers::Description& description = (*source)->device.description;
  ModelFiles files;
  auto stages = load_stages(config, description.skeleton, description.rate_hz, files, partners);
  if (!stages) return of_stream(config.name, stages.error());
  auto stream = std::make_unique<OpenStream>();
  stream->config = config;
  stream->source = std::move(*source);
  stream->stages = std::move(*stages);
  return stream;
}

std::vector<std::size_t> opening_order(const std::vector<config::StreamConfig>& streams) {
  std::vector<std::size_t> order(streams.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_partition(
      order, [&](std::size_t number) { return !names_partners(streams[number]); });
  return order;
}

void add_partner(pipeline::PartnerStreams& partners, std::size_t number, const OpenStream& stream) {
  if (pipeline::has_partners(stream.stages.settings)) return;
  partners[stream.config.name] = {
      .stream = static_cast<std::uint32_t>(number),
      .about = {.skeleton = stream.stages.published, .rate_hz = stream.stages.settings.rate_hz}};
}

}  // namespace posed::devices
