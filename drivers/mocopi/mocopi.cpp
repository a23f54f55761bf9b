#include "drivers/mocopi/mocopi.hpp"

#include "drivers/make_device.hpp"
#include "drivers/mocopi/decoder.hpp"
#include "drivers/mocopi/emulator.hpp"
#include "drivers/mocopi/layout.hpp"
#include "drivers/mocopi/protocol.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp_options.hpp"

namespace posed::drivers {
namespace mocopi {
namespace {

constexpr double kDefaultRate_hz = 60.0;

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto rate_hz = parse_device_info(text, identity);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return source_description("mocopi", text, identity, *rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& /*description*/) {
  return std::make_unique<MocopiDecoder>();
}

Result<double> rate_of(const Options& options) {
  const double rate_hz = option<double>(options, "rate_hz");
  if (parse_device_info(device_info_text(rate_hz), "")) return rate_hz;
  return misuse("rate_hz should be more than 0 and at most 1000");
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(mocopi_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto rate_hz = rate_of(*options);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  if (const auto ok = check_udp(udp_settings(*options)); !ok) return std::unexpected(ok.error());
  return describe(device_info_text(*rate_hz), "udp " + option<std::string>(*options, "listen"));
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  const auto options = complete_options(mocopi_driver(), given);
  auto transport = ports.udp(udp_settings(*options));
  if (!transport) return std::unexpected(transport.error());
  return make_device(mocopi_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(mocopi_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto rate_hz = rate_of(*options);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return std::make_unique<MocopiEmulator>(*rate_hz);
}

std::vector<OptionSpec> options() {
  auto specs = udp_options("127.0.0.1:12351");
  specs.push_back({.name = "rate_hz",
                   .default_value = kDefaultRate_hz,
                   .help = "frames a second that the app is set to, 50 or 60"});
  return specs;
}

}  // namespace
}  // namespace mocopi

const Driver& mocopi_driver() {
  static const Driver driver{
      .name = "mocopi",
      .summary = "Sony mocopi: the phone app's motion stream over UDP (unofficial description)",
      .options = mocopi::options(),
      .open = mocopi::open,
      .make_decoder = mocopi::make_decoder,
      .describe = mocopi::describe,
      .expect = mocopi::expect,
      .make_layout = mocopi::make_layout,
      .emulate = mocopi::emulate};
  return driver;
}

}  // namespace posed::drivers
