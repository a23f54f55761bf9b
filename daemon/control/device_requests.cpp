// The control requests for a device or its decoder: calibration and haptics.
#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "daemon/control/request_handler.hpp"
#include "daemon/devices/calibration.hpp"
#include "drivers/glove/traits.hpp"
#include "posed/v1/control.pb.h"

namespace posed::control {
namespace {

using pipeline::DeviceCommand;

constexpr float kMaxVibration_hz = 1000.0F;
constexpr float kMaxVibration_s = 60.0F;

bool within(float value, float least, float most) {
  return std::isfinite(value) && value >= least && value <= most;
}

Result<drivers::glove::Haptics> read_haptics(const v1::ControlRequest::Haptics& wanted) {
  drivers::glove::Haptics haptics{.vibration_hz = wanted.vibration_hz(),
                                  .vibration_s = wanted.vibration_s(),
                                  .vibration = wanted.vibration_amplitude()};
  haptics.force.fill(-1.0F);
  if (static_cast<std::size_t>(wanted.force_size()) > haptics.force.size()) {
    return fail("a hand has five fingers: give at most five forces, thumb to little");
  }
  std::ranges::copy(wanted.force(), haptics.force.begin());
  const bool sound =
      std::ranges::all_of(haptics.force, [](float force) { return within(force, -1.0F, 1.0F); }) &&
      within(haptics.vibration_hz, 0.0F, kMaxVibration_hz) &&
      within(haptics.vibration_s, 0.0F, kMaxVibration_s) && within(haptics.vibration, 0.0F, 1.0F);
  if (sound) return haptics;
  return fail(
      "a force is 0 (free) to 1 (blocked), negative to leave it; a vibration has up to 1000 Hz,"
      " 60 s and an amplitude of 0 to 1");
}

}  // namespace

Result<ControlledStream*> RequestHandler::find_device(const std::string& name) {
  const auto found = find_stream(name);
  if (found && !(*found)->source.empty()) {
    return fail(
        fmt::format("stream {} is a body of source {}; calibrations and haptics are for gloves",
                    name, (*found)->source));
  }
  return found;
}

Result<> RequestHandler::calibrate(const v1::ControlRequest& request, const Requester& requester) {
  const auto& wanted = request.calibrate();
  const auto found = find_device(wanted.stream());
  if (!found) return std::unexpected(found.error());
  const ControlledStream& stream = **found;
  auto compiled =
      devices::compile_calibration(*stream.device->description(), wanted.toml(), wanted.name());
  if (!compiled) return std::unexpected(compiled.error());
  const DeviceCommand command{.kind = DeviceCommand::Kind::kCalibrate,
                              .stream = pipeline::slot_of(stream.stream),
                              .ticket = last_ticket_ + 1,
                              .calibration = compiled->get(),
                              .size = 0,
                              .bytes = {}};
  if (under_way_.size() >= kMaxUnderWay || !daemon_control_.send(command)) {
    return fail("too many changes are under way; wait for their answers and try again");
  }
  under_way_.emplace(++last_ticket_, UnderWay{.requester = requester,
                                              .stream = stream.stream,
                                              .name = stream.name,
                                              .calibration = std::move(*compiled)});
  return {};
}

Result<> RequestHandler::send_haptics(const v1::ControlRequest& request) {
  const auto found = find_device(request.haptics().stream());
  if (!found) return std::unexpected(found.error());
  const ControlledStream& stream = **found;
  const std::string driver_name = stream.device->description()->driver;
  const drivers::Driver* driver = drivers::find_driver(driver_name);
  if (driver == nullptr || driver->glove == nullptr || driver->glove->encode_haptics == nullptr) {
    return fail(fmt::format("stream {} has no haptics: driver '{}' only sends data", stream.name,
                            driver_name));
  }
  const auto haptics = read_haptics(request.haptics());
  if (!haptics) return std::unexpected(haptics.error());
  const auto bytes = driver->glove->encode_haptics(stream.options, *haptics);
  if (!bytes) return std::unexpected(bytes.error());
  if (stream.device->away()) {
    return fail("the glove of stream " + stream.name + " is away: plug it in and try again");
  }
  DeviceCommand command{.kind = DeviceCommand::Kind::kSend,
                        .stream = pipeline::slot_of(stream.stream)};
  if (bytes->size() > command.bytes.size()) return fail("the device's message is too long");
  command.size = static_cast<std::uint16_t>(bytes->size());
  std::ranges::copy(*bytes, command.bytes.begin());
  if (!daemon_control_.send(command))
    return fail("too many messages wait for the device; send fewer");
  return {};
}

}  // namespace posed::control
