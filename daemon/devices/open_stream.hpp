// A stream with its device open and its model files loaded: `run` starts from it, and `check` tries
// it.
#pragma once

#include <memory>
#include <string>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "models/generate/bound_model.hpp"
#include "models/gesture/play_order.hpp"
#include "models/style/style_filter.hpp"
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
  bool endless = false;      // never ends by itself: a device that may be unplugged, a looping clip
  std::string model_file;    // the bytes of the style model's file; empty without a style stage
  std::string gesture_file;  // the same for the gesture model
  pipeline::StreamCounters counters;
};

// Opens the device, or works out from its options what it will be, and reads the files of models
// and calibration. Does not wait for a device that may be unplugged. Errors name the stream. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config);

// For a command that needs the result now (`check`): opens the device that a supervisor would open,
// and tries the calibration on it. Returns an empty string, or one sentence that says why the
// device is not there now. May take a few seconds. Cold.
[[nodiscard]] Result<std::string> try_kept_device(OpenStream& stream);

// The style model, bound to the stream's skeleton; null without a style stage. Cold.
[[nodiscard]] Result<std::unique_ptr<const style::BoundModel>> bind_style(const OpenStream& stream);

// What the generate stage of a stream needs, checked: the gesture model (null if there is none),
// and the labels to perform from the start (empty if there are none). Cold.
struct BoundGesture {
  std::unique_ptr<const generate::BoundModel> model;
  gesture::PlayOrder play;
};
[[nodiscard]] Result<BoundGesture> bind_gesture(const OpenStream& stream);

// Adds the stream's name to an error.
[[nodiscard]] std::unexpected<Error> of_stream(const std::string& name, Error error);

}  // namespace posed::devices
