#include "drivers/glove/connect.hpp"

#include <algorithm>
#include <sstream>

#include "drivers/glove/device_info.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers::glove {
namespace {

constexpr std::int64_t kMaxBaud = 4'000'000;

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
                           std::vector<std::uint32_t> usb_ids) {
  if (auto sound = check_connection(options); !sound) return std::unexpected(sound.error());
  if (link_of(options) == "tcp") return ports.accept(listen_settings(options));
  return ports.serial({.port = option<std::string>(options, "port"),
                       .id = option<std::string>(options, "id"),
                       .baud = static_cast<int>(option<std::int64_t>(options, "baud")),
                       .usb_ids = std::move(usb_ids)});
}

}  // namespace posed::drivers::glove
