#include "daemon/record/recorded_stream.hpp"

#include <span>
#include <utility>

#include "daemon/devices/open_source.hpp"
#include "daemon/devices/stream_host.hpp"

namespace posed::record {
namespace {

log::SourceRow row_of(const devices::OpenSource& source) {
  const drivers::Description& description = source.device.description;
  return {.id = source.number,
          .name = source.config.name,
          .driver = description.driver,
          .text = description.text,
          .identity = description.identity,
          .config = to_json(source.config.options,
                            source.mapping ? source.mapping->text : std::string())};
}

}  // namespace

RecordedSetup recorded_setup(std::span<const std::unique_ptr<devices::OpenSource>> sources,
                             std::size_t slots) {
  RecordedSetup setup{.sources = {}, .slots = slots};
  for (const auto& source : sources) {
    setup.sources.push_back({.row = row_of(*source),
                             .rate_hz = devices::nominal_rate_hz(*source),
                             .bodies = source->has_several() ? kMaxBodies : 0});
  }
  return setup;
}

RecordedStream recorded_stream(const devices::NewStream& stream) {
  const bool first = pipeline::generation_of(stream.id) == 0;
  return {.id = stream.id,
          .source = stream.source.number,
          .body = stream.body.name,
          .from_start = first && !stream.source.has_several(),
          .name = stream.config.name,
          .settings = stream.stages.settings,
          .model_files = stream.stages.model_files};
}

Result<> add_stream_row(log::Writer& writer, const RecordedStream& stream,
                        std::uint64_t first_item) {
  StreamSettings settings = stream.settings;
  for (std::size_t i = 0; i < settings.stages.size(); ++i) {
    if (!stream.model_files[i]) continue;
    auto hash = TRY(writer.add_blob(std::as_bytes(std::span(*stream.model_files[i]))));
    settings.stages[i].model_sha256 = std::move(hash);
  }
  return writer.add(log::StreamRow{.id = stream.id,
                                   .source = stream.source,
                                   .body = stream.body,
                                   .name = stream.name,
                                   .stages_json = to_json(settings),
                                   .first_item = first_item});
}

}  // namespace posed::record
