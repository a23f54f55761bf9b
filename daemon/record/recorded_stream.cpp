#include "daemon/record/recorded_stream.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "daemon/devices/open_stream.hpp"
#include "daemon/devices/source_builder.hpp"

namespace posed::record {
namespace {

// Without its id.
log::SourceRow row_of(const devices::OpenSource& source) {
  const drivers::Description& description = source.device.description;
  return {.name = source.name,
          .driver = description.driver,
          .text = description.text,
          .identity = description.identity,
          .config = to_json(source.options)};
}

}  // namespace

void RecordedSetup::add_device(log::SourceRow row, StreamSettings settings,
                               std::vector<devices::ModelBytes> model_files) {
  const auto source = static_cast<std::uint32_t>(sources.size());
  row.id = source;
  streams.push_back({.id = static_cast<std::uint32_t>(streams.size()),
                     .source = source,
                     .name = row.name,
                     .settings = std::move(settings),
                     .model_files = std::move(model_files)});
  sources.push_back({.row = std::move(row), .rate_hz = streams.back().settings.rate_hz});
}

void RecordedSetup::add_bodies(log::SourceRow row, double rate_hz, std::size_t bodies) {
  row.id = static_cast<std::uint32_t>(sources.size());
  sources.push_back(
      {.row = std::move(row), .rate_hz = rate_hz, .bodies = bodies, .bodies_come = true});
}

RecordedSetup recorded_setup(std::span<const std::unique_ptr<devices::OpenStream>> streams,
                             std::span<const std::unique_ptr<devices::BodySource>> sources,
                             std::size_t slots_to_come) {
  RecordedSetup setup;
  for (const auto& stream : streams) {
    setup.add_device(row_of(*stream->source), stream->stages.settings, stream->stages.model_files);
  }
  for (const auto& source : sources) {
    const double rate_hz = devices::nominal_rate_hz(*source);
    setup.add_bodies(row_of(*source->source), rate_hz, kMaxBodies);
    setup.rate_to_come_hz = std::max(setup.rate_to_come_hz, rate_hz);
  }
  setup.slots_to_come = slots_to_come;
  return setup;
}

RecordedStream recorded_stream(const devices::NewStream& stream) {
  return {.id = stream.id,
          .source = stream.source.number,
          .body = stream.body.name,
          .name = stream.config.name,
          .settings = stream.stages.settings,
          .model_files = stream.stages.model_files};
}

Result<> add_stream_row(log::Writer& writer, const RecordedStream& stream,
                        std::uint64_t first_item) {
  StreamSettings settings = stream.settings;
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    if (!stream.model_files[i]) continue;
    auto hash = writer.add_blob(std::as_bytes(std::span(*stream.model_files[i])));
    if (!hash) return std::unexpected(hash.error());
    settings.stages[i].model_sha256 = std::move(*hash);
  }
  return writer.add(log::StreamRow{.id = stream.id,
                                   .source = stream.source,
                                   .body = stream.body,
                                   .name = stream.name,
                                   .stages_json = to_json(settings),
                                   .first_item = first_item});
}

}  // namespace posed::record
