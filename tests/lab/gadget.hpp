// USB devices in software: the kernel's gadget framework on the device side of dummy_hcd, whose
// host side is an ordinary USB bus. Needs root and the modules that tests/lab/init loads. A step
// that fails ends the program with a message, because the lab cannot work without it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace posed::lab {

struct Ids {
  std::uint16_t vendor = 0, product = 0;
  std::string serial, name;
};

class Gadget {
 public:
  // `controller` is one of /sys/class/udc; each holds one gadget.
  Gadget(std::string controller, const Ids& ids);
  ~Gadget();
  Gadget(const Gadget&) = delete;
  Gadget& operator=(const Gadget&) = delete;

  // Interfaces are numbered in the order of these calls. Call them before the first plug().
  void add_hid(std::span<const std::uint8_t> descriptor, std::size_t report_bytes);
  void add_serial();
  void add_functionfs(const std::string& mount_name);

  void plug();
  void unplug();
  [[nodiscard]] bool plugged() const { return plugged_; }

  // The device's side: the host reads what is written there. For HID only after plug().
  [[nodiscard]] std::filesystem::path hid_node() const;
  [[nodiscard]] std::filesystem::path serial_node() const;

 private:
  void add(const std::string& function);

  std::filesystem::path folder_;
  std::string controller_;
  bool plugged_ = false;
};

[[noreturn]] void give_up(const std::string& why);

}  // namespace posed::lab
