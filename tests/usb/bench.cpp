#include "tests/usb/bench.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace posed::test {
namespace {

constexpr const char* kRoot = "/devices/pci0000:00/0000:00:14.0/usb1";

[[noreturn]] void give_up(const std::string& what, GError* error) {
  const std::string why = error == nullptr ? "" : std::string(": ") + error->message;
  g_clear_error(&error);
  throw std::runtime_error("umockdev does not " + what + why);
}

std::string hex(unsigned value, int digits) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%0*X", digits, value);
  return text.data();
}

// In hexadecimal digits, because a device's strings may not be valid text.
std::string attribute(const std::string& name, const std::string& value) {
  if (value.empty()) return {};
  std::string digits;
  for (const char c : value + "\n") digits += hex(static_cast<std::uint8_t>(c), 2);
  return "H: " + name + "=" + digits + "\n";
}

gboolean on_request(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer of) {
  const auto& answer = *static_cast<const IoctlHandler::Answer*>(of);
  return answer && answer(client) ? TRUE : FALSE;
}

}  // namespace

Bench::Bench() {
  const char* const preloaded = std::getenv("LD_PRELOAD");
  if (preloaded == nullptr || std::string_view(preloaded).find("umockdev") == std::string::npos) {
    throw std::runtime_error("run it as ctest does, with LD_PRELOAD=libumockdev-preload.so.0");
  }
  testbed_ = umockdev_testbed_new();
  // Users other than the owner must be able to read it, and /dev must exist before its first node.
  const std::filesystem::path root = file_of("");
  std::filesystem::permissions(root, std::filesystem::perms(0755));
  std::filesystem::create_directories(root / "dev");
}

Bench::~Bench() { g_object_unref(testbed_); }

std::filesystem::path Bench::file_of(const std::string& node) const {
  gchar* const root = umockdev_testbed_get_root_dir(testbed_);
  std::filesystem::path path = root;
  g_free(root);
  path += node;
  return path;
}

void Bench::add(const std::string& devices) {
  GError* error = nullptr;
  if (umockdev_testbed_add_from_string(testbed_, devices.c_str(), &error) == FALSE) {
    give_up("take a device", error);
  }
}

void Bench::remove(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    umockdev_testbed_remove_device(testbed_, ("/sys" + path).c_str());
  }
}

std::string usb_path(const UsbIds& ids) {
  return std::string(kRoot) + "/1-" + std::to_string(ids.port);
}

std::string usb_node(int number) {
  std::array<char, 32> node{};
  std::snprintf(node.data(), node.size(), "/dev/bus/usb/001/%03d", number);
  return node.data();
}

std::string describe_usb_device(const UsbIds& ids, int number,
                                const std::vector<std::uint8_t>& content) {
  const std::string node = usb_node(number).substr(5);
  std::string bytes;
  for (const std::uint8_t byte : content) bytes += hex(byte, 2);
  return "P: " + usb_path(ids) + "\nN: " + node + (bytes.empty() ? "" : "=" + bytes) +
         "\nE: DEVNAME=/dev/" + node + "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n" +
         attribute("bDeviceClass", "00") + attribute("busnum", "1") +
         attribute("devnum", std::to_string(number)) + attribute("idVendor", hex(ids.vendor, 4)) +
         attribute("idProduct", hex(ids.product, 4)) + attribute("serial", ids.serial) +
         attribute("manufacturer", ids.maker) + attribute("product", ids.product_name) + "\n";
}

std::string describe_interface(const UsbIds& ids, int interface) {
  return "P: " + usb_path(ids) + "/1-" + std::to_string(ids.port) + ":1." +
         std::to_string(interface) + "\nE: DEVTYPE=usb_interface\nE: SUBSYSTEM=usb\n" +
         attribute("bInterfaceNumber", hex(static_cast<unsigned>(interface), 2)) + "\n";
}

IoctlData resolve(UMockdevIoctlData* from, std::size_t offset, std::size_t bytes) {
  return IoctlData(umockdev_ioctl_data_resolve(from, offset, bytes, nullptr));
}

IoctlHandler::IoctlHandler(Answers answers)
    : answers_(std::move(answers)), base_(umockdev_ioctl_base_new()) {
  g_signal_connect(base_, "handle-ioctl", G_CALLBACK(on_request), &answers_.ioctl);
  g_signal_connect(base_, "handle-read", G_CALLBACK(on_request), &answers_.read);
  g_signal_connect(base_, "handle-write", G_CALLBACK(on_request), &answers_.write);
}

IoctlHandler::~IoctlHandler() { g_object_unref(base_); }

void IoctlHandler::attach(const Bench& bench, const std::string& node) {
  GError* error = nullptr;
  if (umockdev_testbed_attach_ioctl(bench.testbed(), node.c_str(), base_, &error) == FALSE) {
    give_up("answer for " + node, error);
  }
  // umockdev aborts the program at an open() whose ioctl file it may not read, even if the open()
  // was refused.
  std::filesystem::permissions(bench.file_of("/ioctl" + node), std::filesystem::perms::all);
}

}  // namespace posed::test
