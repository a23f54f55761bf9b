#include "tests/lab/functionfs.hpp"

#include <endian.h>
#include <fcntl.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "tests/lab/gadget.hpp"

namespace posed::lab {
namespace {

constexpr int kLookAround_ms = 100;
constexpr std::uint8_t kHidClass = 3, kHidDescriptor = 0x21, kReportDescriptor = 0x22;
constexpr std::uint8_t kDeviceToHost = 0x80;
constexpr std::uint8_t kGetReport = 0x01;

void add(std::vector<std::uint8_t>& to, std::initializer_list<unsigned> bytes) {
  for (const unsigned byte : bytes) to.push_back(static_cast<std::uint8_t>(byte));
}

void add_u32(std::vector<std::uint8_t>& to, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) {
    to.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

// Interface, HID and, on the last one, endpoint descriptors of one speed.
std::vector<std::uint8_t> speed_descriptors(int interfaces, unsigned interval) {
  std::vector<std::uint8_t> all;
  for (int i = 0; i < interfaces; ++i) {
    const bool last = i + 1 == interfaces;
    add(all,
        {9, USB_DT_INTERFACE, static_cast<unsigned>(i), 0, last ? 1U : 0U, kHidClass, 0, 0, 0});
    add(all, {9, kHidDescriptor, 0x11, 0x01, 0, 1, kReportDescriptor, 24, 0});
  }
  add(all, {7, USB_DT_ENDPOINT, 0x81, 3, 64, 0, interval});
  return all;
}

// linux/usb/functionfs.h: magic, length, flags, one count per speed, then the descriptors.
std::vector<std::uint8_t> all_descriptors(int interfaces) {
  const auto full = speed_descriptors(interfaces, 4), high = speed_descriptors(interfaces, 6);
  const auto count = static_cast<std::size_t>(2 * interfaces + 1);
  std::vector<std::uint8_t> all;
  add_u32(all, FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  add_u32(all, 5 * 4 + full.size() + high.size());
  add_u32(all, FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC);
  add_u32(all, count);
  add_u32(all, count);
  all.insert(all.end(), full.begin(), full.end());
  all.insert(all.end(), high.begin(), high.end());
  return all;
}

std::vector<std::uint8_t> no_strings() {
  std::vector<std::uint8_t> all;
  for (const std::size_t word :
       {std::size_t{FUNCTIONFS_STRINGS_MAGIC}, std::size_t{16}, std::size_t{0}, std::size_t{0}}) {
    add_u32(all, word);
  }
  return all;
}

int open_file(const std::filesystem::path& path, int flags) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CLOEXEC | flags);
  if (fd < 0) give_up("cannot open " + path.string() + ": " + std::strerror(errno));
  return fd;
}

void write_all(int fd, const std::vector<std::uint8_t>& bytes) {
  if (::write(fd, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
    give_up(std::string("FunctionFS refuses the descriptors: ") + std::strerror(errno));
  }
}

}  // namespace

FunctionFsHid::FunctionFsHid(const std::string& name, const std::filesystem::path& folder,
                             int interfaces, Reports reports)
    : reports_(std::move(reports)) {
  std::filesystem::create_directories(folder);
  if (::mount(name.c_str(), folder.c_str(), "functionfs", 0, nullptr) != 0) {
    give_up("cannot mount FunctionFS: " + std::string(std::strerror(errno)));
  }
  control_ = open_file(folder / "ep0", 0);
  write_all(control_, all_descriptors(interfaces));
  write_all(control_, no_strings());
  // Non-blocking only avoids waiting for the plug; a report still waits for the host.
  input_ = open_file(folder / "ep1", O_NONBLOCK);
  events_ = std::jthread([this](const std::stop_token& stop) { answer_events(stop); });
}

FunctionFsHid::~FunctionFsHid() {
  events_ = {};
  ::close(input_);
  ::close(control_);
}

bool FunctionFsHid::send(std::span<const std::byte> report) {
  while (true) {
    const ssize_t sent = ::write(input_, report.data(), report.size());
    if (sent >= 0 || errno != EINTR) return sent == static_cast<ssize_t>(report.size());
  }
}

void FunctionFsHid::answer_events(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd wanted{.fd = control_, .events = POLLIN, .revents = 0};
    if (::poll(&wanted, 1, kLookAround_ms) <= 0) continue;
    usb_functionfs_event event{};
    if (::read(control_, &event, sizeof(event)) != sizeof(event)) continue;
    if (event.type != FUNCTIONFS_SETUP) continue;
    const usb_ctrlrequest& setup = event.u.setup;
    answer(setup.bRequestType, setup.bRequest, le16toh(setup.wValue), le16toh(setup.wLength));
  }
}

void FunctionFsHid::answer(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                           std::uint16_t length) {
  std::array<std::byte, 256> bytes{};
  if ((request_type & kDeviceToHost) == 0) {
    const ssize_t got = ::read(control_, bytes.data(), std::min<std::size_t>(length, bytes.size()));
    if (got > 0) reports_.set(std::span(bytes).first(static_cast<std::size_t>(got)));
    return;
  }
  if (request != kGetReport) {
    // FunctionFS stalls the transfer when a read is made where a write is due.
    if (::read(control_, bytes.data(), 0) >= 0) give_up("a stall was not taken");
    return;
  }
  const Bytes report = reports_.get(static_cast<std::uint8_t>(value & 0xFF));
  const auto size = std::min<std::size_t>(report.size(), length);
  if (::write(control_, report.data(), size) < 0 && errno != EIDRM) {
    give_up("a feature report was not taken: " + std::string(std::strerror(errno)));
  }
}

}  // namespace posed::lab
