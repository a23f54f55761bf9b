#include "drivers/transport/enumerate.hpp"

#include <hidapi.h>
#include <libserialport.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <mutex>

#include "drivers/transport/usb_sysfs.hpp"

namespace posed::drivers {
namespace {

namespace fs = std::filesystem;

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
    text += (text.empty() ? "" : ", ") + one.node + (one.is_usb ? " (" + one.identity() + ")" : "");
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

}  // namespace posed::drivers
