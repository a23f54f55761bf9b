// A computer that exists in a temporary folder only, and on which all is right.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/tools/doctor/doctor.hpp"
#include "drivers/options.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

struct HealthyMachine {
  HealthyMachine() {
    machine.root = folder.path();
    machine.user = "ann";
    machine.groups = {"ann", "dialout", "plugdev"};
    machine.priority_limit = 20;
    machine.locked_limit_bytes = doctor::kNoLimit;
    machine.clock = doctor::ClockState::kSynchronised;
    machine.free_bytes = [](const auto&) { return std::uint64_t{1} << 40; };
    machine.may_write = [](const auto&) { return true; };
    machine.try_bind = [](const auto&) { return Result<>(); };
    put("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
    put("proc/sys/net/core/rmem_max", "4194304");
    put("etc/udev/rules.d/70-posed.rules", "# rules");
  }

  // Writes a file below the root, with a line end.
  void put(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = folder.path() / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << '\n';
  }
  void remove(const std::string& path) const { std::filesystem::remove(folder.path() / path); }

  // An adapter that the user may open, unless there is an error.
  void plug_in(const std::string& open_error = {}) {
    machine.nodes.push_back({.info = {.node = "/dev/ttyUSB0", .is_usb = true}, .group = "dialout"});
    machine.nodes.back().info.open_error = open_error;
  }

  TempFolder folder;
  doctor::Machine machine;
};

// A config with one glove on a serial port.
[[nodiscard]] inline config::DaemonConfig glove_config() {
  config::DaemonConfig config;
  config::StreamConfig glove;
  glove.name = "right";
  glove.driver = "cyberglove";
  glove.options = drivers::complete_options(*drivers::find_driver("cyberglove"), {}).value();
  config.streams.push_back(glove);
  return config;
}

}  // namespace posed::test
