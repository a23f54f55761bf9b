// The list of all drivers. A new device adds its name to both lists.
#include <algorithm>
#include <array>

#include "drivers/driver.hpp"

namespace posed::drivers {

using Entry = const Driver&();
Entry axis_driver, cyberglove_driver, described_driver, file_driver, fivedt_driver, labels_driver,
    landmarks_driver, lucidgloves_driver, mocopi_driver, mvn_driver, natnet_driver, p5_driver,
    posed_driver, rokoko_driver, template_glove_driver, template_mocap_driver, vmc_driver;

std::span<const Driver> registry() {
  static const std::array drivers{
      axis_driver(),   cyberglove_driver(), described_driver(),      file_driver(),
      fivedt_driver(), labels_driver(),     landmarks_driver(),      lucidgloves_driver(),
      mocopi_driver(), mvn_driver(),        natnet_driver(),         p5_driver(),
      posed_driver(),  rokoko_driver(),     template_glove_driver(), template_mocap_driver(),
      vmc_driver()};
  return drivers;
}

const Driver* find_driver(std::string_view name) {
  const auto at = std::ranges::find(registry(), name, &Driver::name);
  return at == registry().end() ? nullptr : &*at;
}

}  // namespace posed::drivers
