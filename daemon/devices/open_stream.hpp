// A stream with its device open and its model files loaded: `run` starts from it, and `check` tries
// it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "models/stage_type.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct OpenStream {
  config::StreamConfig config;
  // For its engine; without the hashes of its models, which only the recorder knows.
  pipeline::StreamSettings settings;
  // Without transport and decoder if the device may be unplugged, because its supervisor opens it.
  // The description is there from the start, derived from the options.
  drivers::Device device;
  std::shared_ptr<devices::PresentDevice> present = std::make_shared<devices::PresentDevice>();
  std::unique_ptr<drivers::TransportFactory> ports;
  // null: use the device's default
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;
  std::unique_ptr<pipeline::DeviceSlot> slot;  // null for a device that cannot come back
  bool endless = false;  // never ends by itself: a device that may be unplugged, a looping clip
  std::vector<std::string> model_files;  // the bytes of each stage's model file; empty without one
  pipeline::StreamCounters counters;
};

// Opens the device, or works out from its options what it will be, and reads the files of models
// and calibration. Does not wait for a device that may be unplugged. Errors name the stream. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config);

// For a command that needs the result now (`check`): opens the device that a supervisor would open,
// and tries the calibration on it. Returns an empty string, or one sentence that says why the
// device is not there now. May take a few seconds. Cold.
[[nodiscard]] Result<std::string> try_kept_device(OpenStream& stream);

// What the stages of a stream start with.
struct BoundStages {
  // One for each stage, bound to the stream's skeleton and rate; null for a stage without a model.
  std::vector<std::unique_ptr<const StageModel>> models;
  // What the stages do from the start on; without stream and ticket.
  std::vector<pipeline::Command> first_commands;

  [[nodiscard]] std::vector<const StageModel*> borrowed() const;
};
// Checks and binds the models. Cold.
[[nodiscard]] Result<BoundStages> bind_stages(const OpenStream& stream);

// The engine of stream number `id`, untimed. `bound` outlives it. Cold.
[[nodiscard]] Result<pipeline::EngineOptions> make_engine(std::uint32_t id,
                                                          const OpenStream& stream,
                                                          const BoundStages& bound);

// Adds the stream's name to an error.
[[nodiscard]] std::unexpected<Error> of_stream(const std::string& name, Error error);

}  // namespace posed::devices
