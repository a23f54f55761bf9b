#include "daemon/devices/calibration.hpp"

#include <filesystem>

#include "drivers/glove/traits.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::devices {

Result<std::unique_ptr<const OwnedCalibration>> compile_calibration(
    const drivers::Description& description, const std::string& toml, const std::string& file) {
  const drivers::Driver* driver = drivers::find_driver(description.driver);
  const auto hand = description.skeleton ? hand_side(*description.skeleton) : std::nullopt;
  if (driver == nullptr || driver->glove == nullptr || !hand) {
    return misuse(
        "driver " + in_quotes(description.driver) + " has no sensors that can be calibrated", file);
  }
  const auto model = TRY(driver->glove->glove_model(description));
  const auto parsed = TRY(drivers::glove::parse_calibration(toml, file));
  auto compiled = TRY(drivers::glove::make_calibration(model, parsed, *hand, description.identity));
  return std::make_unique<const OwnedCalibration>(
      OwnedCalibration{std::move(compiled), toml, std::filesystem::path(file).filename().string()});
}

}  // namespace posed::devices
