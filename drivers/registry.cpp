// The list of all drivers. Each new device adds one line here.
#include <algorithm>
#include <array>

#include "drivers/axis/axis.hpp"
#include "drivers/cyberglove/cyberglove.hpp"
#include "drivers/described/described.hpp"
#include "drivers/driver.hpp"
#include "drivers/file/file.hpp"
#include "drivers/fivedt/fivedt.hpp"
#include "drivers/labels/labels.hpp"
#include "drivers/lucidgloves/lucidgloves.hpp"
#include "drivers/mocopi/mocopi.hpp"
#include "drivers/mvn/mvn.hpp"
#include "drivers/natnet/natnet.hpp"
#include "drivers/p5/p5.hpp"
#include "drivers/posed/posed.hpp"
#include "drivers/rokoko/rokoko.hpp"
#include "drivers/template/template.hpp"
#include "drivers/template_mocap/template_mocap.hpp"
#include "drivers/vmc/vmc.hpp"

namespace posed::drivers {

std::span<const Driver> registry() {
  static const std::array drivers{
      axis_driver(),        cyberglove_driver(), described_driver(),
      file_driver(),        fivedt_driver(),     labels_driver(),
      lucidgloves_driver(), mocopi_driver(),     mvn_driver(),
      natnet_driver(),      p5_driver(),         posed_driver(),
      rokoko_driver(),      template_driver(),   template_mocap_driver(),
      vmc_driver(),
  };
  return drivers;
}

const Driver* find_driver(std::string_view name) {
  const auto at = std::ranges::find(registry(), name, &Driver::name);
  return at == registry().end() ? nullptr : &*at;
}

}  // namespace posed::drivers
