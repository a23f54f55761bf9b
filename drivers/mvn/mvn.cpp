#include "drivers/mvn/mvn.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "drivers/make_device.hpp"
#include "drivers/mvn/decoder.hpp"
#include "drivers/mvn/emulator.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/options.hpp"
#include "drivers/rate_text.hpp"
#include "drivers/transport/network_options.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers {
namespace mvn {
namespace {

constexpr double kDefaultRate_hz = 60.0;
constexpr std::int64_t kDefaultLongest = 1472;  // bytes: the usual 1500 of a network without heads
constexpr std::int64_t kMaxLongest = 65'000;

// The device info: what the options say, because MVN tells nothing about itself.
struct DeviceInfo {
  bool stream = false;  // TCP
  double rate_hz = kDefaultRate_hz;
};

std::string device_info_text(const DeviceInfo& info) {
  return std::string("mvn link=") + (info.stream ? "tcp" : "udp") +
         " rate=" + clip::number_text(info.rate_hz);
}

Result<DeviceInfo> parse_device_info(const std::string& text, const std::string& identity) {
  for (const bool stream : {false, true}) {
    const std::string start = std::string("mvn link=") + (stream ? "tcp" : "udp") + " rate=";
    if (const auto rate_hz = parse_rate(text, start)) return DeviceInfo{stream, *rate_hz};
  }
  return fail("is not described as Xsens MVN ('mvn link=udp rate=60'); is it another device?",
              identity);
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto info = parse_device_info(text, identity);
  if (!info) return std::unexpected(info.error());
  return source_description("mvn", text, identity, info->rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto info = parse_device_info(description.text, description.identity);
  if (!info) return std::unexpected(info.error());
  return std::make_unique<MvnDecoder>(info->stream);
}

Result<std::vector<Type>> types_of(const Options& options) {
  std::vector<Type> types;
  for (const std::string& word : words_option(options, "types")) {
    int number = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, number);
    const bool known = number == 1 || number == 2 || number == 5 || number == 12 || number == 13 ||
                       (number >= 20 && number <= 25);
    if (error != std::errc() || stop != end || !known) {
      return misuse("types should be a list of 01, 02, 05, 12, 13 and 20 to 25");
    }
    types.push_back(static_cast<Type>(number));
  }
  if (std::ranges::none_of(types, is_pose)) {
    return misuse("types should have 01, 02 or 05, because only these hold poses");
  }
  return types;
}

Result<MvnEmulator::Settings> emulator_settings(const Options& options) {
  const double rate_hz = option<double>(options, "rate_hz");
  const auto characters = option<std::int64_t>(options, "characters");
  const auto longest = option<std::int64_t>(options, "datagram_bytes");
  if (!(rate_hz > 0.0 && rate_hz <= kMostRate_hz)) {
    return misuse("rate_hz should be more than 0 and at most 1000");
  }
  if (characters < 1 || characters > 2) return misuse("characters should be 1 or 2");
  if (longest < 100 || longest > kMaxLongest) {
    return misuse("datagram_bytes should be 100 to 65000");
  }
  auto types = types_of(options);
  if (!types) return std::unexpected(types.error());
  return MvnEmulator::Settings{.rate_hz = rate_hz,
                               .types = std::move(*types),
                               .characters = static_cast<std::size_t>(characters),
                               .longest = static_cast<std::size_t>(longest)};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(mvn_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto settings = emulator_settings(*options);
  if (!settings) return std::unexpected(settings.error());
  if (const auto ok = check_network(*options); !ok) return std::unexpected(ok.error());
  const bool stream = option<std::string>(*options, "link") == "tcp";
  return describe(device_info_text({.stream = stream, .rate_hz = settings->rate_hz}),
                  network_identity(*options));
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  auto transport = open_network(*complete_options(mvn_driver(), given), ports);
  if (!transport) return std::unexpected(transport.error());
  return make_device(mvn_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(mvn_driver(), given);
  if (!options) return std::unexpected(options.error());
  auto settings = emulator_settings(*options);
  if (!settings) return std::unexpected(settings.error());
  return std::make_unique<MvnEmulator>(std::move(*settings));
}

std::vector<OptionSpec> options() {
  auto specs = network_options("udp", "127.0.0.1:9763");
  specs.push_back({.name = "rate_hz",
                   .default_value = kDefaultRate_hz,
                   .help = "samples a second that the Network Streamer is set to"});
  specs.push_back({.name = "types",
                   .default_value = std::string("02 12 13"),
                   .help = "of the emulator: the types of datagrams that it sends"});
  specs.push_back(
      {.name = "characters", .default_value = std::int64_t{2}, .help = "of the emulator: 1 or 2"});
  specs.push_back({.name = "datagram_bytes",
                   .default_value = kDefaultLongest,
                   .help = "of the emulator: longer samples are split"});
  return specs;
}

}  // namespace
}  // namespace mvn

const Driver& mvn_driver() {
  static const Driver driver{
      .name = "mvn",
      .summary = "Xsens MVN (Movella): people in suits, with or without gloves, over UDP or TCP",
      .options = mvn::options(),
      .open = mvn::open,
      .make_decoder = mvn::make_decoder,
      .describe = mvn::describe,
      .expect = mvn::expect,
      .make_layout = mvn::make_layout,
      .emulate = mvn::emulate};
  return driver;
}

}  // namespace posed::drivers
