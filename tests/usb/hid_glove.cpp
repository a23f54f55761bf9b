#include "tests/usb/hid_glove.hpp"

#include <fcntl.h>
#include <linux/hidraw.h>
#include <linux/input.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace posed::test {
namespace {

constexpr std::size_t kMaxUnread = 64;  // the queue length in the kernel's drivers/hid/hidraw.c

// 64 vendor bytes without a report number.
constexpr const char* kReportDescriptor = "0600FF0901A1010902150026FF00750895408102C0";

std::string hid_ids(const UsbIds& ids, const char* form) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), form, unsigned{ids.vendor}, unsigned{ids.product});
  return text.data();
}

}  // namespace

HidGlove::HidGlove(Bench& bench, UsbIds ids)
    : bench_(bench),
      ids_(std::move(ids)),
      handler_({.ioctl = [this](UMockdevIoctlClient* client) { return answer(client); },
                .read = [this](UMockdevIoctlClient* client) { return answer_read(client); },
                .write = [this](UMockdevIoctlClient* client) { return answer_write(client); }}) {}

HidGlove::~HidGlove() {
  if (bell_ >= 0) unplug();
}

void HidGlove::plug() {
  // Two gloves on different ports never share a number.
  const int number = 10 * number_++ + ids_.port;
  const std::string name = "hidraw" + std::to_string(number);
  const std::string usb = usb_path(ids_);
  const std::string interface = usb + "/1-" + std::to_string(ids_.port) + ":1.0";
  const std::string hid_name = hid_ids(ids_, "0003:%04X:%04X.") + std::to_string(number);
  const std::string hid = interface + "/" + hid_name;
  const std::string hidraw = hid + "/hidraw/" + name;
  const std::lock_guard lock(mutex_);
  node_ = "/dev/" + name;
  paths_ = {hidraw, hid, interface, usb};
  reports_.clear();
  handler_.attach(bench_, node_);
  const auto fifo = bench_.file_of(node_);
  if (::mkfifo(fifo.c_str(), 0600) == 0)
    bell_ = ::open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (bell_ < 0) throw std::runtime_error("there is no FIFO " + fifo.string());
  bench_.add(describe_usb_device(ids_, number, {}) + describe_interface(ids_, 0) + "P: " + hid +
             "\nE: SUBSYSTEM=hid\nE: HID_ID=" + hid_ids(ids_, "0003:%08X:%08X") +
             "\nE: HID_NAME=glove\nE: HID_UNIQ=\nH: report_descriptor=" + kReportDescriptor +
             "\n\nP: " + hidraw + "\nE: DEVNAME=" + node_ + "\nE: SUBSYSTEM=hidraw\nA: dev=240:" +
             std::to_string(number) + "\\n\nL: device=../../../" + hid_name + "\n");
}

// Wakes readers that wait for a report; their read() then reports the end of the device.
void HidGlove::unplug() {
  const std::lock_guard lock(mutex_);
  bench_.remove(paths_);
  std::filesystem::remove(bench_.file_of(node_));
  if (::write(bell_, "", 1) != 1) throw std::runtime_error("the FIFO is full");
  ::close(bell_);
  bell_ = -1;
}

bool HidGlove::say(std::span<const std::byte> report) {
  const std::lock_guard lock(mutex_);
  if (bell_ < 0 || reports_.size() >= kMaxUnread) return false;
  reports_.emplace_back(report.begin(), report.end());
  return ::write(bell_, "", 1) == 1;
}

HidGlove::Bytes HidGlove::received() {
  const std::lock_guard lock(mutex_);
  return std::exchange(received_, {});
}

bool HidGlove::has_open(UMockdevIoctlClient* client) const {
  return bell_ >= 0 && node_ == umockdev_ioctl_client_get_devnode(client);
}

bool HidGlove::answer(UMockdevIoctlClient* client) {
  if (umockdev_ioctl_client_get_request(client) != HIDIOCGRAWINFO) return false;
  const auto data = resolve(umockdev_ioctl_client_get_arg(client), 0, sizeof(hidraw_devinfo));
  if (!data) return false;  // the program was killed meanwhile
  hidraw_devinfo info{};
  info.bustype = BUS_USB;
  info.vendor = static_cast<std::int16_t>(ids_.vendor);
  info.product = static_cast<std::int16_t>(ids_.product);
  std::memcpy(data->data, &info, sizeof info);
  umockdev_ioctl_client_complete(client, 0, 0);
  return true;
}

// One report per read, truncated to the reader's buffer.
bool HidGlove::answer_read(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  const bool here = has_open(client);
  if (!here || reports_.empty()) {
    umockdev_ioctl_client_complete(client, -1, here ? EAGAIN : EIO);
    return true;
  }
  UMockdevIoctlData* const room = umockdev_ioctl_client_get_arg(client);
  const Bytes& report = reports_.front();
  const std::size_t size = std::min(report.size(), static_cast<std::size_t>(room->data_len));
  std::memcpy(room->data, report.data(), size);
  reports_.pop_front();
  std::byte rung{};
  if (::read(bell_, &rung, 1) != 1) return false;
  umockdev_ioctl_client_complete(client, static_cast<glong>(size), 0);
  return true;
}

bool HidGlove::answer_write(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  UMockdevIoctlData* const data = umockdev_ioctl_client_get_arg(client);
  const auto bytes = std::as_bytes(std::span(data->data, static_cast<std::size_t>(data->data_len)));
  received_.insert(received_.end(), bytes.begin(), bytes.end());
  const bool here = has_open(client);
  umockdev_ioctl_client_complete(client, here ? data->data_len : -1, here ? 0 : EIO);
  return true;
}

}  // namespace posed::test
