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
  std::uint32_t number = 0;  // index in the reader and in the log
  const drivers::Driver* driver = nullptr;
  // Has no transport and no decoder if the device may be unplugged, because its supervisor opens
  // it. The description is there from the start, derived from the options.
  drivers::Device device;
  std::shared_ptr<PresentDevice> present = std::make_shared<PresentDevice>();
  std::unique_ptr<drivers::TransportFactory> ports;
  std::optional<drivers::Mapping> mapping{};  // as SourceConfig::skeleton; empty: none
  // null: use the device's default
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;
  std::unique_ptr<pipeline::DeviceSlot> slot;  // null for a device that cannot come back
  bool endless = false;  // never ends by itself: a device that may be unplugged, a looping clip
  pipeline::SourceCounters counters;
  // Passes bodies to the reader and back; null while the source is only tried.
  std::unique_ptr<pipeline::BodyExchange> exchange;
  // How many slots each of its streams may fill in the rings to the pipeline and to the publisher.
  std::size_t decoded_slots = 0, finished_slots = 0;

  // Whether the device describes its bodies, which come and go; else it has one from the start.
  [[nodiscard]] bool has_several() const { return driver->make_layout != nullptr; }
};

// Opens the device, or works out from its options what it will be, reads the calibration, and loads
// the model files of the source's streams, which are bound when a body is there. Does not wait for
// a device that may be unplugged. Errors name the source, or the stream of a device with one body.
// Cold.
Result<std::unique_ptr<OpenSource>> open_source(config::SourceConfig config, ModelFiles& files);

// Returns the error with the name of the source, or of its only stream, in the message.
[[nodiscard]] std::unexpected<Error> in_source(const OpenSource& source, Error error);

// For a command that needs the result now (`check`): opens the device that a supervisor would open,
// and tries the calibration on it. Returns an empty string, or one sentence that says why the
// device is not there now; an error for wrong options or a calibration that does not fit. May take
// a few seconds. Cold.
Result<std::string> try_kept_device(OpenSource& source);

// The one body of a device that does not describe its bodies.
[[nodiscard]] drivers::Body only_body(const OpenSource& source);

// Returns the frames a second of each body by the config or else the device's description; if they
// say nothing, 120 for a device with several bodies, 0 for others.
[[nodiscard]] double nominal_rate_hz(const OpenSource& source);
// The rate for which rings and queues make room for one of its bodies; never 0.
[[nodiscard]] double expected_rate_hz(const OpenSource& source, const drivers::Body& body);

}  // namespace posed::devices
