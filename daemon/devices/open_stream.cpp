#include "daemon/devices/open_stream.hpp"

#include "daemon/devices/calibration.hpp"
#include "drivers/glove/load_calibration.hpp"
#include "drivers/transport/file.hpp"
#include "models/gesture/model_file.hpp"
#include "proto/frame/hand_skeleton.hpp"
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

// Whether the constrain stage runs: on hands, unless the config says otherwise.
Result<bool> wants_constrain(const OpenStream& stream) {
  const auto& skeleton = stream.device.description.skeleton;
  const bool hand = skeleton && hand_side(*skeleton);
  if (stream.config.constrain.value_or(false) && !hand) {
    return misuse("only hands (hand45) can be constrained; leave out its [stream.constrain] table");
  }
  return stream.config.constrain.value_or(hand);
}

Result<> fill_settings(OpenStream& stream) {
  const config::StreamConfig& config = stream.config;
  const auto constrain = wants_constrain(stream);
  if (!constrain) return std::unexpected(constrain.error());
  stream.settings = {.publish_raw = config.publish_raw,
                     .stale_after_s = config.stale_after_s,
                     .rate_hz = stream.device.description.rate_hz,
                     .constrain = *constrain};
  if (config.style) {
    stream.settings.style = config.style->filter;
    stream.settings.style_model.name = config.style->model.filename().string();
  }
  if (config.generate) {
    stream.settings.generate = config.generate->live;
    stream.settings.gesture_model.name = config.generate->model.filename().string();
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
  if (opened) opened = fill_settings(*stream);
  if (!opened) return of_stream(config.name, opened.error());
  if (config.style) {
    auto bytes = model_file::load(config.style->model);
    if (!bytes) return of_stream(config.name, bytes.error());
    stream->model_file = std::move(*bytes);
  }
  if (config.generate && !config.generate->model.empty()) {
    auto bytes = model_file::load(config.generate->model);
    if (!bytes) return of_stream(config.name, bytes.error());
    stream->gesture_file = std::move(*bytes);
  }
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

Result<std::unique_ptr<const style::BoundModel>> bind_style(const OpenStream& stream) {
  if (!stream.config.style) return nullptr;
  if (!stream.device.description.skeleton) {
    const std::string what =
        "driver '" + stream.config.driver + "' gives no poses, so it cannot be styled";
    return of_stream(stream.config.name, misuse(what).error());
  }
  const std::filesystem::path& path = stream.config.style->model;
  const auto model = style::parse_model(std::as_bytes(std::span(stream.model_file)), path);
  if (!model) return of_stream(stream.config.name, model.error());
  auto bound = style::bind_model(*model, *stream.device.description.skeleton,
                                 stream.config.style->filter, path.filename());
  if (!bound) return of_stream(stream.config.name, bound.error());
  return bound;
}

Result<BoundGesture> bind_gesture(const OpenStream& stream) {
  if (!stream.config.generate) return BoundGesture{};
  const config::GenerateConfig& config = *stream.config.generate;
  const drivers::Description& device = stream.device.description;
  if (!device.skeleton || device.skeleton->channels.empty()) {
    const std::string what = "driver '" + stream.config.driver +
                             "' gives no joint angles, so there is nothing to generate";
    return of_stream(stream.config.name, misuse(what).error());
  }
  BoundGesture bound;
  if (config.model.empty()) return bound;
  const std::string name = config.model.filename();
  auto model = gesture::parse_model(std::as_bytes(std::span(stream.gesture_file)), config.model);
  if (!model) return of_stream(stream.config.name, model.error());
  auto ready = generate::bind_model(std::move(*model), *device.skeleton, device.rate_hz, name);
  if (!ready) return of_stream(stream.config.name, ready.error());
  bound.model = std::move(*ready);
  if (config.labels.empty()) return bound;
  const auto order =
      gesture::make_play_order(bound.model->gesture(), config.labels, config.tempo, config.loop);
  if (!order) return of_stream(stream.config.name, order.error());
  bound.play = *order;
  return bound;
}

}  // namespace posed::devices
