#include "drivers/make_device.hpp"

#include <utility>

#include "drivers/glove/calibrated_decoder.hpp"

namespace posed::drivers {

Result<Device> make_device(const Driver& driver, const std::string& text,
                           const std::string& identity) {
  auto description = driver.describe(text, identity);
  if (!description) return std::unexpected(description.error());
  auto decoder = driver.make_decoder(*description);
  if (!decoder) return std::unexpected(decoder.error());
  glove::CalibratedDecoder* const calibrated = glove::calibrated_decoder(**decoder);
  return Device{.description = std::move(*description),
                .transport = nullptr,
                .decoder = std::move(*decoder),
                .warnings = {},
                .calibrated = calibrated};
}

Result<Device> make_device(const Driver& driver, const Description& expected,
                           std::unique_ptr<Transport> transport) {
  auto device = make_device(driver, expected.text, expected.identity);
  if (device) device->transport = std::move(transport);
  return device;
}

Description source_description(std::string_view driver, const std::string& text,
                               const std::string& identity, double rate_hz) {
  return {.driver = std::string(driver),
          .text = text,
          .identity = identity,
          .skeleton = nullptr,
          .samples = {},
          .rate_hz = rate_hz};
}

}  // namespace posed::drivers
