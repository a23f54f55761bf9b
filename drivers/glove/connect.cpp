#include "drivers/glove/connect.hpp"

#include <chrono>
#include <utility>

#include "drivers/glove/device_info.hpp"
#include "drivers/glove/line_reader.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers::glove {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::int64_t kMaxBaud = 4'000'000;
constexpr milliseconds kPatience{3000};  // for a line: an ESP32 starts in about a second
constexpr milliseconds kOneRead{50};
constexpr std::size_t kMaxLine = 256;  // bytes

std::string link_of(const Options& options) {
  return options.contains("link") ? option<std::string>(options, "link") : "serial";
}

ListenSettings listen_settings(const Options& options) {
  return {.endpoint = option<std::string>(options, "listen"),
          .peers = words_option(options, "peers")};
}

}  // namespace

std::vector<OptionSpec> serial_options(std::int64_t baud) {
  return {{.name = "port",
           .default_value = std::string(),
           .help = "serial port, such as /dev/ttyUSB0; left out, the glove is found by id"},
          {.name = "id",
           .default_value = std::string(),
           .help = "USB serial number or port path, as posed devices lists it"},
          {.name = "hand", .default_value = std::string("right"), .help = "right or left"},
          {.name = "baud", .default_value = baud, .help = "bits a second of the serial port"}};
}

std::vector<OptionSpec> tcp_options(std::string_view listen) {
  return {{.name = "link",
           .default_value = std::string("serial"),
           .help = "serial, or tcp for a glove that connects to us"},
          {.name = "listen",
           .default_value = std::string(listen),
           .help = "address and port that the glove connects to, with link = tcp"},
          {.name = "peers",
           .default_value = std::string(),
           .help = "addresses that may connect, separated by blanks; left out: this machine only"}};
}

Result<Side> hand_option(const Options& options) {
  return parse_side(option<std::string>(options, "hand"));
}

Result<> check_connection(const Options& options) {
  const std::string link = link_of(options);
  if (link == "tcp") return check_listen(listen_settings(options));
  if (link != "serial") return misuse("link should be \"serial\" or \"tcp\"");
  const std::int64_t baud = option<std::int64_t>(options, "baud");
  if (baud < 1 || baud > kMaxBaud) return misuse("baud should be 1 to 4000000");
  return {};
}

Result<Connection> connect(const Options& options, TransportFactory& ports,
                           std::vector<std::uint32_t> usb) {
  TRY(check_connection(options));
  if (link_of(options) == "tcp") return ports.accept(listen_settings(options));
  return ports.serial({.port = option<std::string>(options, "port"),
                       .id = option<std::string>(options, "id"),
                       .baud = static_cast<int>(option<std::int64_t>(options, "baud")),
                       .usb_ids = std::move(usb)});
}

Result<Connection> connect(const Options& options, TransportFactory& ports,
                           std::span<const KnownUsb> usb) {
  std::vector<std::uint32_t> ids;
  for (const KnownUsb& one : usb) {
    ids.push_back(static_cast<std::uint32_t>(one.vendor) << 16 | one.product);
  }
  return connect(options, ports, std::move(ids));
}

Result<> await_line(Connection& link, const std::function<bool(std::string_view)>& is_line) {
  LineReader<kMaxLine> lines;
  bool any = false, good = false;
  for (const auto begin = Clock::now(); !good || lines.in_line();) {
    const bool late = Clock::now() - begin > kPatience;
    if (late && good) break;  // it never pauses after a line
    if (late) {
      return fail(any ? "what comes is no line of this glove; check baud and port"
                      : "the glove sends nothing; check that it is switched on, and its baud",
                  link.name());
    }
    const auto bytes = TRY(link.read(kOneRead));
    any = any || !bytes.empty();
    lines.feed(bytes, [&](std::string_view text) { good = good || is_line(text); }, [] {});
  }
  return {};
}

Opened opened(Connection link, double reopen_after_s) {
  std::string identity = link.identity();
  return {.identity = std::move(identity),
          .transport = make_link_transport(std::move(link)),
          .reopen_after_s = reopen_after_s};
}

}  // namespace posed::drivers::glove
