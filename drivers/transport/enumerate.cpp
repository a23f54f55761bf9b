// Lists the devices of this machine. What is known about a USB device is read from sysfs: that
// needs no permission on its node, so a device that cannot be opened still has a name.
#include "drivers/transport/enumerate.hpp"

#include <hidapi.h>
#include <libserialport.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "drivers/transport/node.hpp"
#include "proto/text/list.hpp"

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

std::string read_line(const fs::path& file) {
  std::string line;
  std::getline(std::ifstream(file), line);
  // A device chooses these strings: unprintable characters must not reach a terminal.
  std::erase_if(line, [](unsigned char c) { return c < ' ' || c == 0x7F; });
  const auto first = line.find_first_not_of(' ');
  const auto last = line.find_last_not_of(' ');
  return first == std::string::npos ? "" : line.substr(first, last - first + 1);
}

unsigned read_number(const fs::path& file, int base) {
  const std::string line = read_line(file);
  unsigned number = 0;
  std::from_chars(line.data(), line.data() + line.size(), number, base);
  return number;
}

bool file_exists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

void describe_device(const fs::path& device, DeviceInfo& info) {
  info.is_usb = true;
  info.vendor = static_cast<std::uint16_t>(read_number(device / "idVendor", 16));
  info.product = static_cast<std::uint16_t>(read_number(device / "idProduct", 16));
  info.serial = read_line(device / "serial");
  info.port_path = device.filename();
  const std::string maker = read_line(device / "manufacturer");
  const std::string product = read_line(device / "product");
  // Many product names already begin with the maker's name.
  info.name = maker.empty() || product.starts_with(maker) ? product
              : product.empty()                           ? maker
                                                          : maker + " " + product;
}

bool is_hub(const fs::path& device) { return read_line(device / "bDeviceClass") == "09"; }

// Fills the USB part of `info` (ids, serial, port path, interface, name) from the device's
// directory or link below /sys; leaves it unchanged when no USB device is above.
void describe_usb(const fs::path& device, DeviceInfo& info) {
  std::error_code failed;
  fs::path at = fs::canonical(device, failed);
  if (failed) return;
  for (; at.has_relative_path(); at = at.parent_path()) {
    if (file_exists(at / "bInterfaceNumber")) {
      info.interface = static_cast<int>(read_number(at / "bInterfaceNumber", 16));
    }
    if (file_exists(at / "idVendor")) return describe_device(at, info);
  }
}

// Says why the node cannot be opened and how to fix it; empty when it can. access() uses the real
// user id, which equals the effective one: posed is never set-uid.
std::string open_error_of(const std::string& node) {
  return ::access(node.c_str(), R_OK | W_OK) == 0 ? "" : node_open_error(node, errno);
}

fs::path class_entry(const std::string& kind, const std::string& node) {
  return fs::path("/sys/class") / kind / fs::path(node).filename() / "device";
}

std::string numbers_of(const DeviceInfo& device) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%04x:%04x", device.vendor, device.product);
  return text.data();
}

std::string all_of(const std::vector<DeviceInfo>& device) {
  std::string text;
  for (const DeviceInfo& one : device) {
    add_word(text, one.node + (one.is_usb ? " (" + one.identity() + ")" : ""));
  }
  return text;
}

}  // namespace

std::string DeviceInfo::identity() const {
  if (!is_usb) return node;
  return numbers_of(*this) + " " + (serial.empty() ? port_path : serial);
}

bool DeviceInfo::answers_to(std::string_view id) const {
  if (id.empty()) return false;
  const std::string at_interface = port_path + ":1." + std::to_string(interface);
  return id == serial || id == port_path || id == identity() || (is_usb && id == at_interface);
}

// libserialport omits ports that exist only as a driver's placeholder (ttyS4 and on).
std::vector<DeviceInfo> list_serial_ports() {
  std::vector<DeviceInfo> found;
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return found;
  for (sp_port** port = ports; *port != nullptr; ++port) {
    const std::string node = sp_get_port_name(*port);
    DeviceInfo device{.bus = Bus::kSerial, .node = node, .open_error = open_error_of(node)};
    describe_usb(class_entry("tty", node), device);
    found.push_back(std::move(device));
  }
  sp_free_port_list(ports);
  std::ranges::sort(found, {}, &DeviceInfo::node);
  return found;
}

std::vector<DeviceInfo> list_hid_nodes() {
  static std::mutex one_at_a_time;  // hidapi keeps its state in globals
  const std::lock_guard lock(one_at_a_time);
  std::vector<DeviceInfo> found;
  hid_device_info* all = hid_enumerate(0, 0);
  for (const hid_device_info* info = all; info != nullptr; info = info->next) {
    const std::string node = info->path;
    // hidapi lists a node once for each of its usages.
    if (!found.empty() && found.back().node == node) continue;
    DeviceInfo device{.bus = Bus::kHid, .node = node, .open_error = open_error_of(node)};
    describe_usb(class_entry("hidraw", node), device);
    found.push_back(std::move(device));
  }
  hid_free_enumeration(all);
  std::ranges::sort(found, {}, &DeviceInfo::node);
  return found;
}

Result<DeviceInfo> choose(const std::vector<DeviceInfo>& device, const std::string& id,
                          const std::function<bool(const DeviceInfo&)>& wanted,
                          const std::string& kind) {
  std::vector<DeviceInfo> fitting;
  for (const DeviceInfo& one : device) {
    if (wanted(one) && (id.empty() || one.answers_to(id))) fitting.push_back(one);
  }
  if (fitting.size() == 1) return fitting.front();
  if (fitting.empty() && id.empty()) {
    return fail("no " + kind + " of such a glove is there; plug it in, or name it by port or id");
  }
  if (fitting.empty()) {
    return fail("no " + kind + " with the id " + id + " is there; plug the glove in, or see " +
                "`posed devices` for what is");
  }
  return fail(std::to_string(fitting.size()) + " fit: " + all_of(fitting) + "; name the " + kind +
              " by its id (a port path tells twins apart)");
}

DeviceInfo find_node(const std::vector<DeviceInfo>& device, const std::string& path) {
  std::error_code failed;
  const fs::path node = fs::canonical(path, failed);
  const auto at = std::ranges::find_if(
      device, [&](const DeviceInfo& one) { return !failed && one.node == node; });
  if (at != device.end()) return *at;
  DeviceInfo unlisted;
  unlisted.node = path;
  return unlisted;
}

std::vector<DeviceInfo> list_usb_devices() {
  std::vector<DeviceInfo> found;
  std::error_code failed;
  for (fs::directory_iterator entry("/sys/bus/usb/devices", failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const fs::path device = entry->path();
    if (!file_exists(device / "idVendor") || is_hub(device)) continue;
    std::array<char, 32> node{};
    std::snprintf(node.data(), node.size(), "/dev/bus/usb/%03u/%03u",
                  read_number(device / "busnum", 10), read_number(device / "devnum", 10));
    DeviceInfo info{
        .bus = Bus::kUsb, .node = node.data(), .open_error = open_error_of(node.data())};
    describe_usb(device, info);
    found.push_back(std::move(info));
  }
  std::ranges::sort(found, {}, &DeviceInfo::node);
  return found;
}

}  // namespace posed::drivers
