#include "drivers/transport/usb_sysfs.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <fstream>

#include "drivers/transport/node.hpp"

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

}  // namespace

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

// access() uses the real user id, which equals the effective one: posed is never set-uid.
std::string open_error_of(const std::string& node) {
  return ::access(node.c_str(), R_OK | W_OK) == 0 ? "" : node_open_error(node, errno);
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
