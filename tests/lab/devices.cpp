#include "tests/lab/devices.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>

#include "drivers/transport/enumerate.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/lab/functionfs.hpp"
#include "tests/lab/gadget.hpp"

namespace posed::lab {
namespace {

using drivers::TransportFactory;

constexpr int kP5Interface = 1;

// 64 vendor bytes without a report number, as a 5DT Ultra's reports are.
constexpr std::array<std::uint8_t, 21> kVendorBytes{0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01,
                                                    0x09, 0x02, 0x15, 0x00, 0x26, 0xFF, 0x00,
                                                    0x75, 0x08, 0x95, 0x40, 0x81, 0x02, 0xC0};
constexpr std::size_t kHidReport = 64;

// The device's side of a HID gadget: its node exists while it is plugged in.
class HidSide {
 public:
  explicit HidSide(const Gadget& gadget) : gadget_(gadget) {}
  ~HidSide() { close(); }

  void open() {
    const std::lock_guard lock(mutex_);
    fd_ = ::open(gadget_.hid_node().c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) give_up("the HID gadget has no node: " + std::string(std::strerror(errno)));
  }
  void close() {
    const std::lock_guard lock(mutex_);
    if (const int fd = std::exchange(fd_, -1); fd >= 0) ::close(fd);
  }
  bool say(std::span<const std::byte> report) {
    const std::lock_guard lock(mutex_);
    return fd_ >= 0 &&
           ::write(fd_, report.data(), report.size()) == static_cast<ssize_t>(report.size());
  }

 private:
  const Gadget& gadget_;
  std::mutex mutex_;
  int fd_ = -1;
};

// The device's side of a serial gadget: a port like the host's.
class SerialSide {
 public:
  explicit SerialSide(const Gadget& gadget) : gadget_(gadget) {}

  void open() {
    auto link = TransportFactory().serial({.port = gadget_.serial_node()});
    if (!link) give_up("the serial gadget has no node: " + link.error().message);
    const std::lock_guard lock(mutex_);
    transport_ = drivers::make_link_transport(std::move(*link));
  }
  void close() {
    const std::lock_guard lock(mutex_);
    transport_.reset();
  }
  bool say(std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex_);
    return transport_ != nullptr && transport_->send(bytes);
  }

 private:
  const Gadget& gadget_;
  std::mutex mutex_;
  std::unique_ptr<drivers::Transport> transport_;
};

// State shared by the lambdas of a LabDevice.
template <typename Side>
struct Bench {
  explicit Bench(const std::string& controller, const Ids& ids)
      : gadget(controller, ids), side(gadget) {}
  Gadget gadget;
  Side side;
};

template <typename Side>
std::unique_ptr<LabDevice> device_of(const std::shared_ptr<Bench<Side>>& bench,
                                     const std::string& name) {
  auto device = std::make_unique<LabDevice>();
  device->name = name;
  device->plug = [bench] {
    bench->gadget.plug();
    bench->side.open();
  };
  device->unplug = [bench] {
    bench->gadget.unplug();
    bench->side.close();
  };
  device->say = [bench](auto bytes) { return bench->side.say(bytes); };
  return device;
}

// The creation time of a device node, from devtmpfs. It is on the clock of files, which runs at the
// same speed as ours.
std::optional<Moment> made(const std::string& node) {
  struct statx info{};
  if (::statx(AT_FDCWD, node.c_str(), 0, STATX_BTIME, &info) != 0) return {};
  if ((info.stx_mask & STATX_BTIME) == 0) give_up("this kernel does not tell when a node was made");
  const auto age = std::chrono::system_clock::now().time_since_epoch() -
                   std::chrono::seconds(info.stx_btime.tv_sec) -
                   std::chrono::nanoseconds(info.stx_btime.tv_nsec);
  return std::chrono::steady_clock::now() - age;
}

std::function<std::optional<Moment>()> looks_for(std::vector<drivers::DeviceInfo> (*list)(),
                                                 const Ids& ids) {
  return [list, ids]() -> std::optional<Moment> {
    const auto all = list();
    const auto at = std::ranges::find_if(all, [&](const drivers::DeviceInfo& one) {
      return one.vendor == ids.vendor && one.product == ids.product && one.open_error.empty();
    });
    if (at == all.end()) return {};
    return made(at->node);
  };
}

std::unique_ptr<LabDevice> hid_device() {
  const Ids ids{.vendor = 0x5D70, .product = 0x0000, .serial = "HID-1", .name = "Ultra 14R"};
  auto bench = std::make_shared<Bench<HidSide>>("dummy_udc.0", ids);
  bench->gadget.add_hid(kVendorBytes, kHidReport);
  auto device = device_of(bench, "hidraw");
  device->there_since = looks_for(drivers::list_hid_nodes, ids);
  device->open = [ids]() -> Result<std::unique_ptr<drivers::Transport>> {
    auto link = TRY(TransportFactory().hid({.vendor = ids.vendor, .id = ids.serial}));
    return drivers::make_link_transport(std::move(link));
  };
  return device;
}

std::unique_ptr<LabDevice> serial_device() {
  const Ids ids{.vendor = 0x1A86, .product = 0x55D4, .serial = "ACM-1", .name = "lucidgloves"};
  auto bench = std::make_shared<Bench<SerialSide>>("dummy_udc.2", ids);
  bench->gadget.add_serial();
  auto device = device_of(bench, "ttyacm");
  device->serial = true;
  // The kernel's gadget takes bytes only while a program has its side open.
  device->plug_hung = [bench] { bench->gadget.plug(); };
  device->there_since = looks_for(drivers::list_serial_ports, ids);
  device->open = [ids]() -> Result<std::unique_ptr<drivers::Transport>> {
    auto link = TRY(TransportFactory().serial({.id = ids.serial}));
    return drivers::make_link_transport(std::move(link));
  };
  return device;
}

// These begin like a real P5's feature reports: firmware, head and LEDs.
FunctionFsHid::Bytes feature(std::uint8_t report) {
  FunctionFsHid::Bytes bytes{std::byte{report}};
  bytes.resize(4, std::byte{0x04});
  return bytes;
}

std::unique_ptr<LabDevice> usb_device() {
  const Ids ids{.vendor = 0x0D7F, .product = 0x0100, .serial = "", .name = "P5 Virtual Reality"};
  auto gadget = std::make_shared<Gadget>("dummy_udc.1", ids);
  gadget->add_functionfs("p5");
  auto side = std::make_shared<FunctionFsHid>(
      "p5", "/ffs-p5", kP5Interface + 1,
      FunctionFsHid::Reports{.get = feature, .set = [](std::span<const std::byte>) {}});
  auto device = std::make_unique<LabDevice>();
  device->name = "libusb";
  device->plug = [gadget, side] { gadget->plug(); };
  device->unplug = [gadget] { gadget->unplug(); };
  device->say = [side](auto bytes) { return side->send(bytes); };
  device->there_since = looks_for(drivers::list_usb_devices, ids);
  device->open = [ids]() -> Result<std::unique_ptr<drivers::Transport>> {
    auto link = TRY(TransportFactory().usb(
        {.vendor = ids.vendor, .product = ids.product, .interface = kP5Interface}));
    const auto firmware = TRY(link.feature(9, 4));
    if (firmware != feature(9)) return fail("feature report 9 came back changed");
    TRY(link.set_feature(firmware));
    return drivers::make_usb_transport(std::move(link));
  };
  return device;
}

}  // namespace

LabDevices lab_devices() {
  LabDevices devices;
  devices.push_back(hid_device());
  devices.push_back(usb_device());
  devices.push_back(serial_device());
  return devices;
}

}  // namespace posed::lab
