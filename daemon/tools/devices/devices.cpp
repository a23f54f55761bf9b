// `posed devices`: lists connected devices, how a config names them, which driver may fit, and what
// prevents opening them.
#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "drivers/driver.hpp"
#include "drivers/known_usb.hpp"
#include "drivers/transport/enumerate.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

using drivers::Bus;
using drivers::DeviceInfo;
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

// The device, with a row of the list as its line.
Findings describe(const DeviceInfo& one, const std::vector<DeviceInfo>& all) {
  std::vector<Findings> fitting;
  std::string hand, names;
  for (const drivers::KnownUsb& known : drivers::known_usb()) {
    if (!known.fits(one)) continue;
    fitting.push_back(Findings().add("name", known.driver).add("certain", !known.adapter));
    add_word(names, std::string(known.driver) + (known.adapter ? "?" : ""));
    hand = known.hand(one);
  }
  const auto or_null = [](const std::string& text) {
    return text.empty() ? std::nullopt : std::optional(text);
  };
  // A device's name for itself may contain any bytes.
  const auto shown = [](const std::string& text) { return text.empty() ? "-" : clean(text); };
  const auto usb = [&](std::uint16_t number) {
    return one.is_usb ? std::optional(usb_numbers(number)) : std::nullopt;
  };
  const std::string id = id_of(one, all);
  Findings findings;
  findings.add("bus", bus_name(one.bus))
      .add("node", one.node)
      .add("id", or_null(id))
      .add("vendor", usb(one.vendor))
      .add("product", usb(one.product))
      .add("serial", or_null(one.serial))
      .add("port_path", or_null(one.port_path))
      .add("name", or_null(one.name))
      .add("drivers", fitting)
      .add("hand", or_null(hand))
      .add("open_error", or_null(one.open_error))
      .say(fmt::format("{:<16} {:<18} {:<16} {:<6} {}", clean(one.node), shown(id), shown(names),
                       shown(hand), shown(one.name)));
  return one.open_error.empty() ? findings : findings.say("    " + clean(one.open_error));
}

Findings list_devices() {
  const auto all = list_all();
  std::vector<Findings> devices, known;
  for (const DeviceInfo& one : all) devices.push_back(describe(one, all));
  for (const drivers::Driver& driver : drivers::registry()) {
    known.push_back(Findings()
                        .add("name", driver.name)
                        .add("summary", driver.summary)
                        .say(fmt::format("  {:<14} {}", driver.name, driver.summary)));
  }
  return Findings()
      .say(devices.empty() ? "no serial port, HID device or USB glove is plugged in"
                           : fmt::format("{:<16} {:<18} {:<16} {:<6} {}", "node", "id", "driver",
                                         "hand", "name"))
      .add("devices", devices)
      .say("")
      .say("drivers:")
      .add("drivers", known);
}

}  // namespace

void add_devices(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("devices", "List the gloves and ports that are plugged in");
  auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "One JSON object on stdout");
  command->footer(kFooter);
  command->callback([as_json, &exit_code] { exit_code = list_devices().show(*as_json, -1); });
}

}  // namespace posed::tools
