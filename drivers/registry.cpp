// The list of all drivers. Each new device adds one line here.
#include <algorithm>
#include <array>

#include "drivers/cyberglove/cyberglove.hpp"
#include "drivers/described/described.hpp"
#include "drivers/driver.hpp"
#include "drivers/file/file.hpp"
#include "drivers/fivedt/fivedt.hpp"
#include "drivers/labels/labels.hpp"
#include "drivers/lucidgloves/lucidgloves.hpp"
#include "drivers/p5/p5.hpp"
#include "drivers/template/template.hpp"
#include "drivers/template_mocap/template_mocap.hpp"

namespace posed::drivers {

std::span<const Driver> registry() {
  static const std::array drivers{
      cyberglove_driver(), described_driver(), file_driver(),
      fivedt_driver(),     labels_driver(),    lucidgloves_driver(),
      p5_driver(),         template_driver(),  template_mocap_driver(),
  };
  return drivers;
}

const Driver* find_driver(std::string_view name) {
  const auto at = std::ranges::find(registry(), name, &Driver::name);
  return at == registry().end() ? nullptr : &*at;
}

}  // namespace posed::drivers
