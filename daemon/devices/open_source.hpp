// A source, that is, an opened device. `run` starts from it, and `check` tries it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/model_files.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct OpenSource {
  std::string name;  // of the source, or of its only stream
  const drivers::Driver* driver = nullptr;
  drivers::Options options;
  // Without transport and decoder if the device may be unplugged, because its supervisor opens it.
  // The description is there from the start, derived from the options.
  drivers::Device device;
  std::shared_ptr<PresentDevice> present = std::make_shared<PresentDevice>();
  std::unique_ptr<drivers::TransportFactory> ports;
  // null: use the device's default
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;
  std::unique_ptr<pipeline::DeviceSlot> slot;  // null for a device that cannot come back
  bool endless = false;  // never ends by itself: a device that may be unplugged, a looping clip
  pipeline::SourceCounters counters;
};

struct SourceOptions {
  std::string name;
  std::string driver;
  drivers::Options options;             // complete
  std::filesystem::path calibration{};  // of a glove; empty: use the device's default
};

// Opens the device, or works out from its options what it will be, and reads the calibration. Does
// not wait for a device that may be unplugged. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenSource>> open_source(const SourceOptions& options);

// The same for a device with several bodies. Reads the model files of its streams, too; they are
// bound when a body is there. Errors name the source.
[[nodiscard]] Result<std::unique_ptr<OpenSource>> open_source(const config::SourceConfig& config,
                                                              ModelFiles& files);

// For a command that needs the result now (`check`): opens the device that a supervisor would open,
// and tries the calibration on it. Returns an empty string, or one sentence that says why the
// device is not there now. May take a few seconds. Cold.
[[nodiscard]] Result<std::string> try_kept_device(OpenSource& source);

}  // namespace posed::devices
