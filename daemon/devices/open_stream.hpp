// A stream with its device open and its model at hand: what `run` starts from and `check` tries.
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
  // Without transport and decoder for a device that comes and goes: its supervisor opens it. The
  // description is there from the start, as the options promise it.
  drivers::Device device;
  std::shared_ptr<devices::PresentDevice> present = std::make_shared<devices::PresentDevice>();
  std::unique_ptr<drivers::TransportFactory> ports;
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;  // null: the default
  std::unique_ptr<pipeline::DeviceSlot> slot;  // null for a device that cannot come back
  bool endless = false;    // never ends by itself: a device that comes and goes, a clip that loops
  std::string model_file;  // the bytes of the style model's file; empty without a style stage
  std::string gesture_file;  // the same of the gesture model
  pipeline::StreamCounters counters;
};

// Opens the device, or finds out how it will be when it comes, and reads the files of models and
// calibration. Waits for no device that comes and goes. Errors name the stream. Cold.
[[nodiscard]] Result<std::unique_ptr<OpenStream>> open_stream(const config::StreamConfig& config);

// For a command that wants to know now what would come (`check`): opens the device that a
// supervisor would open, and tries the calibration on it. Returns why the device is not there now,
// in one sentence, or nothing. May take a few seconds. Cold.
[[nodiscard]] Result<std::string> try_kept_device(OpenStream& stream);

// The style model, bound to the stream's skeleton; null without a style stage. Cold.
[[nodiscard]] Result<std::unique_ptr<const style::BoundModel>> bind_style(const OpenStream& stream);

// What the generate stage needs of a stream, tried: the model, null without one, and what is
// performed from the start, empty when nothing is. Cold.
struct BoundGesture {
  std::unique_ptr<const generate::BoundModel> model;
  gesture::PlayOrder play;
};
[[nodiscard]] Result<BoundGesture> bind_gesture(const OpenStream& stream);

// Whether the stream's last stage constrains: on a hand, unless the config says no. Cold.
[[nodiscard]] Result<bool> bind_constrain(const OpenStream& stream);

// What its engine runs by. Without the hashes of its models, which the recorder knows. Cold.
[[nodiscard]] pipeline::StreamSettings stream_settings(const OpenStream& stream);

// Says which stream an error is about.
[[nodiscard]] std::unexpected<Error> of_stream(const std::string& name, Error error);

}  // namespace posed::devices
