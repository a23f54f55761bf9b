// TransportFactory: how drivers reach devices. One object belongs to one cold thread; it keeps what
// has to stay open while a device is away (listening sockets), and ends every wait when it is told
// to.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/transport/connection.hpp"
#include "drivers/transport/usb.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

struct SerialSettings {
  std::string port{};  // "/dev/ttyUSB0"; empty: found by `id`
  std::string id{};    // USB serial number or port path, as `posed devices` lists it
  int baud = 115200;   // 8N1, no flow control
  // Without port and id: the one port whose USB ids are among these.
  std::vector<std::uint32_t> usb_ids{};  // vendor << 16 | product
};

// For gloves that connect to us.
struct ListenSettings {
  std::string endpoint{};            // "127.0.0.1:5200"
  std::vector<std::string> peers{};  // addresses that may connect; empty: loopback only
};

// For gloves on hidraw nodes.
struct HidSettings {
  std::uint16_t vendor = 0;
  std::vector<std::uint16_t> products{};  // any of these; empty: all of the vendor's
  std::string id{};                       // serial number or port path; empty: the only one
  std::string path{};                     // "/dev/hidraw0" instead of all of the above
};

// Whether these settings make sense, without listening. Cold.
[[nodiscard]] Result<> check_listen(const ListenSettings& settings);

class TransportFactory {
 public:
  TransportFactory() = default;
  TransportFactory(const TransportFactory&) = delete;
  TransportFactory& operator=(const TransportFactory&) = delete;
  ~TransportFactory();

  // Raw mode, exclusive, DTR set. Errors are one sentence: not there, no permission (with the udev
  // rule or group that mends it), in use (by whom, if known). Cold.
  [[nodiscard]] Result<Connection> serial(const SerialSettings& settings);

  // Waits up to half a second for a glove to connect; listens from the first call on, so that a
  // glove that tries in between is kept. Others than the peers are dropped and counted. Cold.
  [[nodiscard]] Result<Connection> accept(const ListenSettings& settings);

  // The device's reports: one a read, and one a write. Cold.
  [[nodiscard]] Result<Connection> hid(const HidSettings& settings);

  // A USB device without a node of its own kind, its interface claimed. Cold.
  [[nodiscard]] Result<UsbLink> usb(const UsbSettings& settings);

  // Ends what is waited for now and later, here and on the links that came from here: for whoever
  // stops while a device is opened. Any thread.
  void cancel() noexcept { cancel_->fire(); }

  // While it is on, nothing is opened or waited for: the functions above check their settings,
  // begin to listen and return an error. So a daemon finds at its start what makes no sense, and a
  // glove that connects at once is kept. Cold.
  void only_prepare(bool on) noexcept { only_prepare_ = on; }

  // Connections dropped so far because no peer in the list made them.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  std::shared_ptr<Cancel> cancel_ = std::make_shared<Cancel>();
  [[nodiscard]] static std::unexpected<Error> not_opened() { return fail("not opened yet"); }

  bool only_prepare_ = false;
  std::uint64_t refused_ = 0;
  std::map<std::string, int> listeners_;  // by endpoint
};

}  // namespace posed::drivers
