#include "tests/lab/gadget.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace posed::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGadgets = "/sys/kernel/config/usb_gadget";
constexpr const char* kEnglish = "strings/0x409";

// configfs needs each value in a single write(), so the value is not buffered.
void put(const fs::path& file, std::string_view value) {
  std::FILE* out = std::fopen(file.c_str(), "w");
  if (out == nullptr) give_up("cannot open " + file.string() + ": " + std::strerror(errno));
  const bool ok = std::fwrite(value.data(), 1, value.size(), out) == value.size();
  if (std::fclose(out) != 0 || !ok) {
    give_up("cannot write '" + std::string(value) + "' to " + file.string() + ": " +
            std::strerror(errno));
  }
}

std::string get(const fs::path& file) {
  std::string line;
  std::getline(std::ifstream(file), line);
  return line;
}

std::string hex(std::uint16_t number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%04x", number);
  return text.data();
}

}  // namespace

void give_up(const std::string& why) {
  std::printf("FAIL the lab itself: %s\n", why.c_str());
  std::exit(EXIT_FAILURE);
}

Gadget::Gadget(std::string controller, const Ids& ids)
    : folder_(fs::path(kGadgets) / controller), controller_(std::move(controller)) {
  fs::create_directories(folder_ / kEnglish);
  fs::create_directories(folder_ / "configs/c.1");
  put(folder_ / "idVendor", hex(ids.vendor));
  put(folder_ / "idProduct", hex(ids.product));
  if (!ids.serial.empty()) put(folder_ / kEnglish / "serialnumber", ids.serial);
  put(folder_ / kEnglish / "manufacturer", "posed lab");
  put(folder_ / kEnglish / "product", ids.name);
}

Gadget::~Gadget() {
  if (plugged_) unplug();
}

void Gadget::add(const std::string& function) {
  fs::create_directory(folder_ / "functions" / function);
  fs::create_directory_symlink(folder_ / "functions" / function,
                               folder_ / "configs/c.1" / function);
}

void Gadget::add_hid(std::span<const std::uint8_t> descriptor, std::size_t report_bytes) {
  const fs::path function = folder_ / "functions/hid.0";
  fs::create_directory(function);
  put(function / "report_length", std::to_string(report_bytes));
  put(function / "report_desc",
      {reinterpret_cast<const char*>(descriptor.data()), descriptor.size()});
  fs::create_directory_symlink(function, folder_ / "configs/c.1/hid.0");
}

void Gadget::add_serial() { add("acm.0"); }

void Gadget::add_functionfs(const std::string& mount_name) { add("ffs." + mount_name); }

void Gadget::plug() {
  put(folder_ / "UDC", controller_);
  plugged_ = true;
}

void Gadget::unplug() {
  put(folder_ / "UDC", "\n");
  plugged_ = false;
}

fs::path Gadget::hid_node() const {
  const std::string device = get(folder_ / "functions/hid.0/dev");  // "major:minor"
  return "/dev/hidg" + device.substr(device.find(':') + 1);
}

fs::path Gadget::serial_node() const {
  return "/dev/ttyGS" + get(folder_ / "functions/acm.0/port_num");
}

}  // namespace posed::lab
