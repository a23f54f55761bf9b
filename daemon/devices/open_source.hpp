// A source, that is, an opened device. `run` starts from it, and `check` tries it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <memory>
#include <optional>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/model_files.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/mapping.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/result.hpp"

namespace posed::devices {

struct OpenSource {
  config::SourceConfig config;
  std::uint32_t number = 0;  // in the reader and in the log
  const drivers::Driver* driver = nullptr;
  // Without transport and decoder if the device may be unplugged, because its supervisor opens it.
  // The description is there from the start, derived from the options.
  drivers::Device device;
  std::shared_ptr<PresentDevice> present = std::make_shared<PresentDevice>();
  std::unique_ptr<drivers::TransportFactory> ports;
  std::optional<drivers::Mapping> mapping{};  // the user's word about the joints of its bodies
  // null: use the device's default
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;
  std::unique_ptr<pipeline::DeviceSlot> slot;  // null for a device that cannot come back
  bool endless = false;  // never ends by itself: a device that may be unplugged, a looping clip
  pipeline::SourceCounters counters;
  // With the reader; null while the source is only tried.
  std::unique_ptr<pipeline::BodyExchange> exchange;
  // How many slots of the rings to the pipeline and to the publisher a stream of it may fill.
  std::size_t decoded_slots = 0, finished_slots = 0;

  // Whether the device describes its bodies, which come and go. Else it has one from the start on.
  [[nodiscard]] bool has_several() const { return driver->make_layout != nullptr; }
};

// Opens the device, or works out from its options what it will be, reads the calibration, and loads
// the model files of the source's streams, which are bound when a body is there. Does not wait for
// a device that may be unplugged. Errors name the source, or the stream of a device with one body.
// Cold.
Result<std::unique_ptr<OpenSource>> open_source(config::SourceConfig config, ModelFiles& files);

// The error, with the name of the source in its message, or that of the only stream.
[[nodiscard]] std::unexpected<Error> in_source(const OpenSource& source, Error error);

// For a command that needs the result now (`check`): opens the device that a supervisor would open,
// and tries the calibration on it. Returns an empty string, or one sentence that says why the
// device is not there now. May take a few seconds. Cold.
Result<std::string> try_kept_device(OpenSource& source);

// The one body of a device that does not describe its bodies.
[[nodiscard]] drivers::Body only_body(const OpenSource& source);

// Frames a second of each body as the config, the driver or the device's description say; 0: they
// do not. A device with several bodies that does not say has the usual rate of mocap systems.
[[nodiscard]] double nominal_rate_hz(const OpenSource& source);
// The rate for which rings and queues make room for one of its bodies; never 0.
[[nodiscard]] double expected_rate_hz(const OpenSource& source, const drivers::Body& body);

}  // namespace posed::devices
