#include "daemon/devices/open_source.hpp"

#include <utility>
#include <vector>

#include "daemon/devices/about_stream.hpp"
#include "daemon/devices/calibration.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/transport/file.hpp"

namespace posed::devices {
namespace {

// A device that may be unplugged is opened later by its supervisor, so that a slow or silent one
// delays neither the start nor the other streams. Here only its options are checked.
Result<> open_device(OpenSource& source) {
  const drivers::Driver& driver = *source.driver;
  if (driver.expect == nullptr) {
    auto device = driver.open(source.options, *source.ports);
    if (!device) return std::unexpected(device.error());
    source.device = std::move(*device);
    source.present->connected(source.device.description);
    const auto* file = dynamic_cast<const drivers::FileTransport*>(source.device.transport.get());
    source.endless = file != nullptr && file->loops();
    return {};
  }
  source.endless = true;
  auto description = driver.expect(source.options);
  if (!description) return std::unexpected(description.error());
  source.ports->only_prepare(true);
  const auto prepared = driver.open(source.options, *source.ports);
  source.ports->only_prepare(false);
  if (!prepared && prepared.error().exit_code == ExitCode::kWrongUse) {
    return std::unexpected(prepared.error());
  }
  source.device.description = std::move(*description);
  source.present->connected(source.device.description);
  source.present->gone();
  return {};
}

Result<> open_calibration(const std::filesystem::path& path, OpenSource& source) {
  if (path.empty()) return {};
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    return fail("there is no such calibration; make one with `posed calibrate --driver " +
                    std::string(source.driver->name) + " --user NAME --out " +
                    path.filename().string() +
                    "`, or leave out `calibration` and use the glove's defaults",
                path.string());
  }
  const auto text = drivers::glove::load_calibration_text(path);
  if (!text) return std::unexpected(text.error());
  auto compiled =
      devices::compile_calibration(*source.present->description(), *text, path.string());
  if (!compiled) return std::unexpected(compiled.error());
  source.present->calibrated({.toml = *text, .file = path.string()});
  source.calibration = std::move(*compiled);
  return {};
}

Result<> open_slot(OpenSource& source) {
  if (source.driver->expect == nullptr) return {};
  source.slot = std::make_unique<pipeline::DeviceSlot>();
  auto wake = system::EventFd::open();
  if (!wake) return std::unexpected(wake.error());
  source.slot->supervisor = std::move(*wake);
  return {};
}

Result<> load_models(const config::SourceConfig& source, ModelFiles& files) {
  std::vector<const config::StreamConfig*> streams{&source.every};
  for (const auto& named : source.named) streams.push_back(&named.stream);
  for (const config::StreamConfig* stream : streams) {
    for (const config::StageConfig& stage : stream->stages) {
      if (stage.model.empty()) continue;
      if (const auto bytes = files.load(stage.model); !bytes) {
        return std::unexpected(bytes.error());
      }
    }
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<OpenSource>> open_source(const SourceOptions& options) {
  auto source = std::make_unique<OpenSource>();
  source->name = options.name;
  source->driver = drivers::find_driver(options.driver);
  if (source->driver == nullptr) return misuse("there is no driver '" + options.driver + "'");
  source->options = options.options;
  source->ports = std::make_unique<drivers::TransportFactory>();
  Result<> opened = open_device(*source);
  if (opened) opened = open_calibration(options.calibration, *source);
  if (opened) opened = open_slot(*source);
  if (!opened) return std::unexpected(opened.error());
  return source;
}

Result<std::unique_ptr<OpenSource>> open_source(const config::SourceConfig& config,
                                                ModelFiles& files) {
  if (auto loaded = load_models(config, files); !loaded) {
    return of_source(config.name, loaded.error());
  }
  auto source =
      open_source({.name = config.name, .driver = config.driver, .options = config.options});
  if (!source) return of_source(config.name, source.error());
  return source;
}

Result<std::string> try_kept_device(OpenSource& source) {
  if (!source.slot) return std::string();
  auto device = source.driver->open(source.options, *source.ports);
  if (!device && device.error().exit_code == ExitCode::kWrongUse) {
    return std::unexpected(device.error());
  }
  if (!device) return device.error().text();
  source.device = std::move(*device);
  source.present->connected(source.device.description);
  if (const auto in_use = source.present->calibration(); !in_use.toml.empty()) {
    const auto fits = compile_calibration(source.device.description, in_use.toml, in_use.file);
    if (!fits) return std::unexpected(fits.error());
  }
  return std::string();
}

}  // namespace posed::devices
