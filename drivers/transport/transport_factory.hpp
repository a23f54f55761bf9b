// TransportFactory: gives drivers access to devices. One object belongs to one cold thread. It
// keeps open what must stay open while a device is away (listening sockets), and ends every wait on
// cancel().
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/transport/connection.hpp"
#include "drivers/transport/subscription.hpp"
#include "drivers/transport/udp.hpp"
#include "drivers/transport/usb.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

struct SerialSettings {
  std::string port{};  // "/dev/ttyUSB0"; empty: found by `id`
  std::string id{};    // USB serial number or port path, as `posed devices` lists it
  int baud = 115200;   // 8N1, no flow control
  // If neither port nor id is given, the one port whose USB ids are in this list is opened.
  std::vector<std::uint32_t> usb_ids{};  // vendor << 16 | product
};

// For devices that connect to posed.
struct ListenSettings {
  std::string endpoint{};             // "127.0.0.1:5200"
  std::vector<std::string> peers{};   // addresses that may connect; empty: loopback only
  std::string_view device = "glove";  // what connects, for sentences
};

// For gloves on hidraw nodes.
struct HidSettings {
  std::uint16_t vendor = 0;
  std::vector<std::uint16_t> products{};  // any of these; empty: all of the vendor's
  std::string id{};                       // serial number or port path; empty: the only one
  std::string path{};                     // "/dev/hidraw0" instead of all of the above
};

// Checks these settings without listening. Cold.
Result<> check_listen(const ListenSettings& settings);

// Checks an address to connect to, "192.168.1.5:7001". Cold.
Result<> check_connect(const std::string& endpoint);

class TransportFactory {
 public:
  TransportFactory() = default;
  TransportFactory(const TransportFactory&) = delete;
  TransportFactory& operator=(const TransportFactory&) = delete;
  ~TransportFactory();

  // Opens a port in raw mode, exclusive, DTR set. Errors are one sentence: missing, no permission
  // (with the udev rule or group that fixes it), in use (by whom, if known). Cold.
  Result<Connection> serial(const SerialSettings& settings);

  // Waits up to half a second for a device to connect. Listens from the first call on, so that one
  // that connects between two calls is kept. Connections from addresses not in `peers` are
  // dropped and counted, and so are those of web browsers. Those of a host that has just flooded
  // wait in the order in which they came: a device that shares its address gets its turn. Cold.
  Result<Connection> accept(const ListenSettings& settings);

  // Connects to a system that serves its data over TCP. Waits for it up to a second, and two more
  // if the last one flooded. Cold.
  Result<Connection> connect(const std::string& endpoint);

  // Opens a hidraw node: one report per read and per write. Cold.
  Result<Connection> hid(const HidSettings& settings);

  // Opens a USB device without a node of its own kind and claims its interface. Cold.
  Result<UsbLink> usb(const UsbSettings& settings);

  // Opens the sockets of a device that sends datagrams. Does not wait for it. Cold.
  Result<std::unique_ptr<UdpTransport>> udp(const UdpSettings& settings);

  // Subscribes to topics of another posed. Waits for it as connect() does; an error says why it
  // refuses. Cold.
  Result<std::unique_ptr<SubscriptionTransport>> subscribe(const SubscriptionSettings& settings);

  // Ends present and future waits, here and on the links made here; for a thread that stops posed
  // while a device is being opened. Any thread.
  void cancel() noexcept { cancel_->fire(); }

  // While it is on, nothing is opened or waited for: the functions above check their settings,
  // begin to listen and return an error. So a daemon finds invalid settings when it starts, and
  // keeps a glove that connects at once. Cold.
  void only_prepare(bool on) noexcept { only_prepare_ = on; }

  // Returns what people should know about the serial port that was opened last: a sentence for the
  // log, or nothing. Given once. Cold.
  [[nodiscard]] std::string consume_note() { return std::exchange(note_, {}); }

  // Number of connections dropped so far because their address is not in the list of peers, because
  // they began like a browser's, or because too many of hosts that have flooded wait.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  std::shared_ptr<Cancel> cancel_ = std::make_shared<Cancel>();
  [[nodiscard]] static std::unexpected<Error> not_opened() { return fail("not opened yet"); }

  struct Listener {
    int fd = -1;
    std::deque<Connection> waiting{};  // of paused hosts
  };
  // Takes the first that waits and may come now.
  static std::optional<Connection> first_waiting(Listener& listener);
  // If the one that posed itself connects to has just flooded.
  void await_pause() const noexcept;

  bool only_prepare_ = false;
  std::string note_{};
  std::uint64_t refused_ = 0;
  std::map<std::string, Listener> listeners_;    // by endpoint
  std::shared_ptr<net::Context> subscriptions_;  // kept while the links come and go
  std::shared_ptr<PausedHosts> paused_ = std::make_shared<PausedHosts>();
};

}  // namespace posed::drivers
