#include "drivers/rokoko/rokoko.hpp"

#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "drivers/rokoko/layout.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp_options.hpp"

namespace posed::drivers {
namespace rokoko {
namespace {

constexpr double kDefaultRate_hz = 60.0;

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto rate_hz = parse_device_info(text, identity);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return source_description("rokoko", text, identity, *rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& /*description*/) {
  return std::make_unique<StudioDecoder>();
}

Result<StudioEmulatorSettings> settings_of(const Options& options) {
  const double rate_hz = option<double>(options, "rate_hz");
  if (!parse_device_info(device_info_text(rate_hz), "")) {
    return misuse("rate_hz should be more than 0 and at most 1000");
  }
  StudioEmulatorSettings settings{
      .rate_hz = rate_hz, .version = StudioVersion::k3, .lz4 = option<bool>(options, "lz4")};
  const auto& version = option<std::string>(options, "version");
  if (version == "2") {
    settings.version = StudioVersion::k2;
  } else if (version == "2.5") {
    settings.version = StudioVersion::k25;
  } else if (version != "3") {
    return misuse("version should be 2, 2.5 or 3");
  }
  return settings;
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(rokoko_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto settings = settings_of(*options);
  if (!settings) return std::unexpected(settings.error());
  if (const auto ok = check_udp(udp_settings(*options)); !ok) return std::unexpected(ok.error());
  return describe(device_info_text(settings->rate_hz),
                  "udp " + option<std::string>(*options, "listen"));
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  const auto options = complete_options(rokoko_driver(), given);
  auto transport = ports.udp(udp_settings(*options));
  if (!transport) return std::unexpected(transport.error());
  return make_device(rokoko_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(rokoko_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto settings = settings_of(*options);
  if (!settings) return std::unexpected(settings.error());
  return std::make_unique<StudioEmulator>(*settings);
}

std::vector<OptionSpec> options() {
  auto specs = udp_options("127.0.0.1:14043");
  specs.push_back({.name = "rate_hz",
                   .default_value = kDefaultRate_hz,
                   .help = "frames a second that Studio is set to stream"});
  specs.push_back({.name = "version",
                   .default_value = std::string("3"),
                   .help = "only for posed emulate: the JSON that it sends, 2, 2.5 or 3"});
  specs.push_back({.name = "lz4",
                   .default_value = true,
                   .help = "only for posed emulate: whether it compresses"});
  return specs;
}

}  // namespace
}  // namespace rokoko

const Driver& rokoko_driver() {
  static const Driver driver{.name = "rokoko",
                             .summary =
                                 "Rokoko Studio's live stream over UDP: suits, gloves, "
                                 "faces, props (JSON 2 and 3, plain or LZ4)",
                             .options = rokoko::options(),
                             .open = rokoko::open,
                             .make_decoder = rokoko::make_decoder,
                             .describe = rokoko::describe,
                             .expect = rokoko::expect,
                             .make_layout = rokoko::make_layout,
                             .emulate = rokoko::emulate};
  return driver;
}

}  // namespace posed::drivers
