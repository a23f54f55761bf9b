// Every kind of glove that the registry has, for the fuzz targets: a driver with the options that
// choose another decoder.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "drivers/described/device_file.hpp"
#include "drivers/driver.hpp"

namespace posed::fuzz {

struct GloveKind {
  const drivers::Driver* driver = nullptr;
  drivers::Options options;
};

inline std::vector<GloveKind> glove_kinds() {
  const std::vector<std::pair<const char*, std::vector<std::string>>> choices{
      {"encoding", {"alpha", "legacy"}},
      {"form", {"8bit", "16bit"}},
      {"model", {"5", "5-wireless", "16", "ultra-wireless", "ultra-usb-5", "ultra-usb-14"}},
      {"device", drivers::described::shipped_devices()}};
  std::vector<GloveKind> kinds;
  for (const drivers::Driver& driver : drivers::registry()) {
    if (driver.glove == nullptr || driver.emulate == nullptr) continue;
    const auto choice = std::ranges::find_if(choices, [&driver](const auto& one) {
      return std::ranges::find(driver.options, one.first, &drivers::OptionSpec::name) !=
             driver.options.end();
    });
    if (choice == choices.end()) {
      kinds.push_back({&driver, {}});
      continue;
    }
    for (const std::string& word : choice->second) {
      kinds.push_back({&driver, {{choice->first, word}}});
    }
  }
  return kinds;
}

}  // namespace posed::fuzz
