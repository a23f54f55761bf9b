#include "drivers/glove/connect.hpp"

#include <algorithm>
#include <sstream>

#include "drivers/glove/greeting.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/ports.hpp"

namespace posed::drivers::glove {
namespace {

constexpr std::int64_t kMaxBaud = 4'000'000;

std::vector<std::string> words_of(std::string text) {
  std::ranges::replace(text, ',', ' ');
  std::istringstream words(text);
  std::vector<std::string> found;
  for (std::string word; words >> word;) found.push_back(word);
  return found;
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

Result<Link> connect(const Options& options, Ports& ports, std::vector<std::uint32_t> usb_ids) {
  const bool may_listen = options.contains("link");
  const std::string link = may_listen ? option<std::string>(options, "link") : "serial";
  if (link == "tcp") {
    return ports.accept({.endpoint = option<std::string>(options, "listen"),
                         .peers = words_of(option<std::string>(options, "peers"))});
  }
  if (link != "serial") return misuse("link should be \"serial\" or \"tcp\"");
  const std::int64_t baud = option<std::int64_t>(options, "baud");
  if (baud < 1 || baud > kMaxBaud) return misuse("baud should be 1 to 4000000");
  return ports.serial({.port = option<std::string>(options, "port"),
                       .id = option<std::string>(options, "id"),
                       .baud = static_cast<int>(baud),
                       .usb_ids = std::move(usb_ids)});
}

}  // namespace posed::drivers::glove
