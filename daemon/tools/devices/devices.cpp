// `posed devices`: lists connected devices, how a config names them, which driver may fit, and what
// prevents opening them.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/tools/command/command.hpp"
#include "drivers/driver.hpp"
#include "drivers/known_usb.hpp"
#include "drivers/transport/enumerate.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

using drivers::Bus;
using drivers::DeviceInfo;
using nlohmann::ordered_json;

constexpr const char* kFooter = R"(examples:
  posed devices              connected devices, and the id for a [[stream]] in the config
  posed devices --json       the same for a script

Bind a stream to a glove, not to a port: id = "SERIAL" or, for gloves without a serial
number, the port path ("1-2.3": always that socket).)";

std::string bus_name(Bus bus) {
  return bus == Bus::kSerial ? "serial" : bus == Bus::kHid ? "hid" : "usb";
}

std::string usb_numbers(std::uint16_t number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04x", number);
  return text.data();
}

// The serial number, or the port path if the serial number is missing or not unique.
std::string id_of(const DeviceInfo& one, const std::vector<DeviceInfo>& all) {
  if (!one.is_usb) return {};
  const auto same = std::ranges::count_if(all, [&](const DeviceInfo& other) {
    return other.bus == one.bus && other.serial == one.serial;
  });
  if (!one.serial.empty() && same == 1) return one.serial;
  const auto ports = std::ranges::count_if(all, [&](const DeviceInfo& other) {
    return other.bus == one.bus && other.port_path == one.port_path;
  });
  return ports == 1 ? one.port_path : one.port_path + ":1." + std::to_string(one.interface);
}

// Serial ports and HID nodes of any kind; of the other USB devices only gloves.
std::vector<DeviceInfo> list_all() {
  std::vector<DeviceInfo> all = drivers::list_serial_ports();
  for (auto& one : drivers::list_hid_nodes()) all.push_back(std::move(one));
  for (auto& one : drivers::list_usb_devices()) {
    const auto fits = [&](const drivers::KnownUsb& known) { return known.fits(one); };
    if (std::ranges::any_of(drivers::known_usb(), fits)) all.push_back(std::move(one));
  }
  return all;
}

ordered_json describe(const DeviceInfo& one, const std::vector<DeviceInfo>& all) {
  ordered_json fitting = ordered_json::array();
  std::string hand;
  for (const drivers::KnownUsb& known : drivers::known_usb()) {
    if (!known.fits(one)) continue;
    fitting.push_back({{"name", known.driver}, {"certain", !known.adapter}});
    hand = known.hand(one);
  }
  const auto or_null = [](const std::string& text) {
    return text.empty() ? ordered_json() : ordered_json(text);
  };
  return {{"bus", bus_name(one.bus)},
          {"node", one.node},
          {"id", or_null(id_of(one, all))},
          {"vendor", one.is_usb ? ordered_json(usb_numbers(one.vendor)) : ordered_json()},
          {"product", one.is_usb ? ordered_json(usb_numbers(one.product)) : ordered_json()},
          {"serial", or_null(one.serial)},
          {"port_path", or_null(one.port_path)},
          {"name", or_null(one.name)},
          {"drivers", fitting},
          {"hand", or_null(hand)},
          {"open_error", or_null(one.open_error)}};
}

// For printing: a device's name for itself may contain any bytes.
std::string text_of(const ordered_json& value) {
  return value.is_null() ? "-" : clean(value.get<std::string>());
}

void print(const ordered_json& device) {
  std::string fitting;
  for (const auto& driver : device["drivers"]) {
    fitting += (fitting.empty() ? "" : ", ") + driver["name"].get<std::string>() +
               (driver["certain"].get<bool>() ? "" : "?");
  }
  std::printf("%-16s %-18s %-16s %-6s %s\n", text_of(device["node"]).c_str(),
              text_of(device["id"]).c_str(), fitting.empty() ? "-" : fitting.c_str(),
              text_of(device["hand"]).c_str(), text_of(device["name"]).c_str());
  if (!device["open_error"].is_null())
    std::printf("    %s\n", text_of(device["open_error"]).c_str());
}

int list_devices(bool as_json) {
  const auto all = list_all();
  ordered_json devices = ordered_json::array(), known = ordered_json::array();
  for (const DeviceInfo& one : all) devices.push_back(describe(one, all));
  for (const drivers::Driver& driver : drivers::registry()) {
    known.push_back({{"name", driver.name}, {"summary", driver.summary}});
  }
  if (as_json) {
    std::printf("%s\n", json_text(ordered_json{{"devices", devices}, {"drivers", known}}).c_str());
    return 0;
  }
  if (devices.empty()) std::printf("no serial port, HID device or USB glove is plugged in\n");
  if (!devices.empty())
    std::printf("%-16s %-18s %-16s %-6s %s\n", "node", "id", "driver", "hand", "name");
  for (const auto& device : devices) print(device);
  std::printf("\ndrivers:\n");
  for (const drivers::Driver& driver : drivers::registry()) {
    std::printf("  %-14s %s\n", std::string(driver.name).c_str(),
                std::string(driver.summary).c_str());
  }
  return 0;
}

}  // namespace

void add_devices(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("devices", "list the gloves and ports that are plugged in");
  auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "one JSON object on stdout");
  command->footer(kFooter);
  command->callback([as_json, &exit_code] { exit_code = list_devices(*as_json); });
}

}  // namespace posed::tools
