#include "daemon/devices/open_stream.hpp"

#include <algorithm>
#include <utility>

#include "daemon/devices/calibration.hpp"
#include "drivers/glove/load_calibration.hpp"
#include "drivers/transport/file.hpp"
#include "models/stages/registry.hpp"
#include "proto/model/model_file.hpp"

namespace posed::devices {
namespace {

// A device that may be unplugged is opened later by its supervisor, so that a slow or silent one
// delays neither the start nor the other streams. Here only its options are checked.
Result<> open_device(const drivers::Driver& driver, OpenStream& stream) {
  if (driver.expect == nullptr) {
    auto device = driver.open(stream.config.options, *stream.ports);
    if (!device) return std::unexpected(device.error());
    stream.device = std::move(*device);
    stream.present->connected(stream.device.description);
    const auto* file = dynamic_cast<const drivers::FileTransport*>(stream.device.transport.get());
    stream.endless = file != nullptr && file->loops();
    return {};
  }
  stream.endless = true;
  auto description = driver.expect(stream.config.options);
  if (!description) return std::unexpected(description.error());
  stream.ports->only_prepare(true);
  const auto prepared = driver.open(stream.config.options, *stream.ports);
  stream.ports->only_prepare(false);
  if (!prepared && prepared.error().exit_code == ExitCode::kWrongUse) {
    return std::unexpected(prepared.error());
  }
  stream.device.description = std::move(*description);
  stream.present->connected(stream.device.description);
  stream.present->gone();
  return {};
}

Result<> open_calibration(OpenStream& stream) {
  const std::filesystem::path& path = stream.config.calibration;
  if (path.empty()) return {};
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    return fail("there is no such calibration; make one with `posed calibrate --driver " +
                    stream.config.driver + " --out " + path.filename().string() +
                    "`, or leave out `calibration` and use the glove's defaults",
                path.string());
  }
  const auto text = drivers::glove::load_calibration_text(path);
  if (!text) return std::unexpected(text.error());
  auto compiled =
      devices::compile_calibration(*stream.present->description(), *text, path.string());
  if (!compiled) return std::unexpected(compiled.error());
  stream.present->calibrated({.toml = *text, .file = path.string()});
  stream.calibration = std::move(*compiled);
  return {};
}

Result<> open_slot(const drivers::Driver& driver, OpenStream& stream) {
  if (driver.expect == nullptr) return {};
  stream.slot = std::make_unique<pipeline::DeviceSlot>();
  auto wake = system::EventFd::open();
  if (!wake) return std::unexpected(wake.error());
  stream.slot->supervisor = std::move(*wake);
  return {};
}

// The stages that the config names, and those that a stream of this skeleton has by default.
Result<std::vector<config::StageConfig>> stages_of(const OpenStream& stream) {
  const config::StreamConfig& config = stream.config;
  const auto& skeleton = stream.device.description.skeleton;
  if (!config.default_stages || !skeleton) return config.stages;
  std::vector<config::StageConfig> stages;
  for (const StageType* type : stage_types()) {
    const auto named = std::ranges::find(config.stages, type, &config::StageConfig::type);
    const bool off = std::ranges::find(config.off, type) != config.off.end();
    if (named != config.stages.end()) {
      stages.push_back(*named);
    } else if (!off && type->is_default != nullptr && type->is_default(*skeleton)) {
      auto parameters = complete_parameters(type->parameters, {});
      if (!parameters) return std::unexpected(parameters.error());
      stages.push_back({.type = type, .parameters = std::move(*parameters)});
    }
  }
  return stages;
}

Result<> open_stages(OpenStream& stream) {
  stream.settings = {.publish_raw = stream.config.publish_raw,
                     .stale_after_s = stream.config.stale_after_s,
                     .rate_hz = stream.device.description.rate_hz};
  auto stages = stages_of(stream);
  if (!stages) return std::unexpected(stages.error());
  for (config::StageConfig& stage : *stages) {
    stream.settings.stages.push_back({.type = stage.type,
                                      .parameters = std::move(stage.parameters),
                                      .model_name = stage.model.filename().string()});
    std::string& file = stream.model_files.emplace_back();
    if (stage.model.empty()) continue;
    auto bytes = model_file::load(stage.model);
    if (!bytes) return std::unexpected(bytes.error());
    file = std::move(*bytes);
  }
  return {};
}

}  // namespace

std::unexpected<Error> of_stream(const std::string& name, Error error) {
  error.message = "stream '" + name + "': " + error.message;
  return std::unexpected(std::move(error));
}

Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config) {
  const drivers::Driver* driver = drivers::find_driver(config.driver);
  if (driver == nullptr) {
    return of_stream(config.name, misuse("there is no driver '" + config.driver + "'").error());
  }
  auto stream = std::make_unique<OpenStream>();
  stream->config = config;
  stream->ports = std::make_unique<drivers::TransportFactory>();
  Result<> opened = open_device(*driver, *stream);
  if (opened) opened = open_calibration(*stream);
  if (opened) opened = open_slot(*driver, *stream);
  if (opened) opened = open_stages(*stream);
  if (!opened) return of_stream(config.name, opened.error());
  return stream;
}

Result<std::string> try_kept_device(OpenStream& stream) {
  if (!stream.slot) return std::string();
  const drivers::Driver& driver = *drivers::find_driver(stream.config.driver);
  auto device = driver.open(stream.config.options, *stream.ports);
  if (!device && device.error().exit_code == ExitCode::kWrongUse) {
    return of_stream(stream.config.name, device.error());
  }
  if (!device) return device.error().text();
  stream.device = std::move(*device);
  stream.present->connected(stream.device.description);
  const auto fits = open_calibration(stream);
  if (!fits) return of_stream(stream.config.name, fits.error());
  return std::string();
}

std::vector<const StageModel*> BoundStages::borrowed() const {
  std::vector<const StageModel*> pointers;
  for (const auto& model : models) pointers.push_back(model.get());
  return pointers;
}

Result<BoundStages> bind_stages(const OpenStream& stream) {
  BoundStages bound;
  const auto& skeleton = stream.device.description.skeleton;
  for (std::size_t i = 0; i < stream.settings.stages.size(); ++i) {
    const pipeline::StageSettings& stage = stream.settings.stages[i];
    auto& model = bound.models.emplace_back();
    if (skeleton && !stream.model_files[i].empty()) {
      auto ready = stage.type->bind_model(std::as_bytes(std::span(stream.model_files[i])),
                                          pipeline::stage_context(stream.settings, i, skeleton),
                                          stage.model_name);
      if (!ready) return of_stream(stream.config.name, ready.error());
      model = std::move(*ready);
    }
    if (stage.type->first_command == nullptr) continue;
    const auto first = stage.type->first_command(stage.parameters, model.get());
    if (!first) return of_stream(stream.config.name, first.error());
    if (!*first) continue;
    bound.first_commands.push_back({.change = {.kind = pipeline::StageChange::Kind::kCommand,
                                               .index = static_cast<std::uint8_t>((*first)->index),
                                               .type = stage.type},
                                    .command = (*first)->command});
  }
  return bound;
}

Result<pipeline::EngineOptions> make_engine(std::uint32_t id, const OpenStream& stream,
                                            const BoundStages& bound) {
  auto engine = pipeline::engine_options(id, stream.settings, stream.device.description.skeleton,
                                         bound.borrowed());
  if (!engine) return of_stream(stream.config.name, engine.error());
  return engine;
}

}  // namespace posed::devices
