#include "daemon/devices/open_source.hpp"

#include <utility>
#include <vector>

#include "daemon/devices/about_stream.hpp"
#include "daemon/devices/calibration.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/transport/file.hpp"

namespace posed::devices {
namespace {

constexpr double kUsualRate_hz = 120.0;     // of mocap systems that do not say
constexpr double kUnknownRate_hz = 1000.0;  // of a device with one body that does not say

// A device that may be unplugged is opened later by its supervisor, so that a slow or silent one
// delays neither the start nor the other streams. Here only its options are checked.
Result<> open_device(OpenSource& source) {
  const drivers::Driver& driver = *source.driver;
  const drivers::Options& options = source.config.options;
  if (driver.expect == nullptr) {
    auto device = TRY(driver.open(options, *source.ports));
    source.device = std::move(device);
    source.present->connected(source.device.description);
    const auto* file = dynamic_cast<const drivers::FileTransport*>(source.device.transport.get());
    source.endless = file != nullptr && file->loops();
    return {};
  }
  source.endless = true;
  auto description = TRY(driver.expect(options));
  source.ports->only_prepare(true);
  const auto prepared = driver.open(options, *source.ports);
  source.ports->only_prepare(false);
  if (!prepared && prepared.error().exit_code == ExitCode::kWrongUse) {
    return std::unexpected(prepared.error());
  }
  source.device.description = std::move(description);
  source.present->connected(source.device.description);
  source.present->gone();
  return {};
}

Result<> open_calibration(OpenSource& source) {
  const std::filesystem::path& path = source.config.named[0].stream.calibration;
  if (path.empty()) return {};
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    return fail("there is no such calibration; make one with `posed calibrate --driver " +
                    std::string(source.driver->name) + " --user NAME --out " +
                    path.filename().string() +
                    "`, or leave out `calibration` and use the glove's defaults",
                path.string());
  }
  const auto text = TRY(drivers::glove::load_calibration_text(path));
  auto compiled =
      TRY(devices::compile_calibration(*source.present->description(), text, path.string()));
  source.present->calibrated({.toml = text, .file = path.string()});
  source.calibration = std::move(compiled);
  return {};
}

Result<> open_mapping(OpenSource& source) {
  if (source.config.skeleton.empty()) return {};
  source.mapping = TRY(drivers::load_mapping(source.config.skeleton.string()));
  return {};
}

Result<> open_slot(OpenSource& source) {
  if (source.driver->expect == nullptr) return {};
  source.slot = std::make_unique<pipeline::DeviceSlot>();
  source.slot->supervisor = TRY(system::EventFd::open());
  return {};
}

Result<> load_models(const config::SourceConfig& source, ModelFiles& files) {
  std::vector<const config::StreamConfig*> streams{&source.every};
  for (const auto& named : source.named) streams.push_back(&named.stream);
  for (const config::StreamConfig* stream : streams) {
    for (const config::StageConfig& stage : stream->stages) {
      if (stage.model.empty()) continue;
      TRY(files.load(stage.model));
    }
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<OpenSource>> open_source(config::SourceConfig config, ModelFiles& files) {
  auto source = std::make_unique<OpenSource>();
  source->driver = drivers::find_driver(config.driver);
  if (source->driver == nullptr) return misuse("there is no driver '" + config.driver + "'");
  source->config = std::move(config);
  source->ports = std::make_unique<drivers::TransportFactory>();
  Result<> opened = open_device(*source);
  if (opened && !source->has_several()) opened = open_calibration(*source);
  if (opened) opened = open_mapping(*source);
  if (opened) opened = open_slot(*source);
  if (opened) opened = load_models(source->config, files);
  if (opened) return source;
  return in_source(*source, opened.error());
}

std::unexpected<Error> in_source(const OpenSource& source, Error error) {
  const std::string& name = source.config.name;
  return source.has_several() ? in_source(name, std::move(error))
                              : in_stream(name, std::move(error));
}

Result<std::string> try_kept_device(OpenSource& source) {
  if (!source.slot) return std::string();
  auto device = source.driver->open(source.config.options, *source.ports);
  if (!device && device.error().exit_code == ExitCode::kWrongUse) {
    return std::unexpected(device.error());
  }
  if (!device) return device.error().text();
  source.device = std::move(*device);
  source.present->connected(source.device.description);
  if (const auto in_use = source.present->calibration(); !in_use.toml.empty()) {
    TRY(compile_calibration(source.device.description, in_use.toml, in_use.file));
  }
  return std::string();
}

drivers::Body only_body(const OpenSource& source) {
  const drivers::Description& device = source.device.description;
  return {.name = {},
          .skeleton = device.skeleton,
          .samples = device.samples,
          .rate_hz = device.rate_hz};
}

double nominal_rate_hz(const OpenSource& source) {
  if (source.config.rate_hz > 0.0) return source.config.rate_hz;
  const double rate_hz = source.device.description.rate_hz;
  return rate_hz > 0.0 || !source.has_several() ? rate_hz : kUsualRate_hz;
}

double expected_rate_hz(const OpenSource& source, const drivers::Body& body) {
  if (source.config.rate_hz > 0.0) return source.config.rate_hz;
  if (source.has_several()) return body.rate_hz > 0.0 ? body.rate_hz : nominal_rate_hz(source);
  const auto& transport = source.device.transport;
  if (transport && transport->rate_hz() > 0.0) return transport->rate_hz();
  return body.rate_hz > 0.0 ? body.rate_hz : kUnknownRate_hz;
}

}  // namespace posed::devices
