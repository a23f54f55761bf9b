#include "drivers/make_device.hpp"

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

}  // namespace posed::drivers
