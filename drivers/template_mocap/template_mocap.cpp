#include "drivers/template_mocap/template_mocap.hpp"

#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/template_mocap/decoder.hpp"
#include "drivers/template_mocap/emulator.hpp"
#include "drivers/template_mocap/layout.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp_options.hpp"

namespace posed::drivers {
namespace mocap {
namespace {

constexpr double kDefaultRate_hz = 100.0;
constexpr std::int64_t kAskEvery_ns = kNanosPerSecond;

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto rate_hz = parse_device_info(text, identity);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return source_description("template_mocap", text, identity, *rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& /*description*/) {
  return std::make_unique<MocapDecoder>();
}

Result<double> rate_of(const Options& options) {
  const double rate_hz = option<double>(options, "rate_hz");
  if (parse_device_info(device_info_text(rate_hz), "")) return rate_hz;
  return misuse("rate_hz should be more than 0 and at most 1000");
}

std::string identity_of(const Options& options) {
  return "udp " + option<std::string>(options, "listen");
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(template_mocap_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto rate_hz = rate_of(*options);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  if (const auto ok = check_udp(udp_settings(*options)); !ok) return std::unexpected(ok.error());
  return describe(device_info_text(*rate_hz), identity_of(*options));
}

// UDP has no connection: the sockets open whether or not the device is there, and the first request
// that has somebody to go to follows its first datagram.
Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  const auto options = complete_options(template_mocap_driver(), given);
  auto transport = ports.udp(udp_settings(*options));
  if (!transport) return std::unexpected(transport.error());
  auto device = make_device(template_mocap_driver(), *expected, std::move(*transport));
  if (!device) return device;
  device->poll = {.request = encode_request(), .period_ns = kAskEvery_ns};
  return device;
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(template_mocap_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto rate_hz = rate_of(*options);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return std::make_unique<MocapEmulator>(*rate_hz);
}

std::vector<OptionSpec> options() {
  auto specs = udp_options("127.0.0.1:7400");
  specs.push_back({.name = "rate_hz",
                   .default_value = kDefaultRate_hz,
                   .help = "frames a second that the system is set to"});
  return specs;
}

}  // namespace
}  // namespace mocap

const Driver& template_mocap_driver() {
  static const Driver driver{
      .name = "template_mocap",
      .summary =
          "an invented mocap system with two people over UDP; copy its folder to begin a "
          "driver with several bodies",
      .options = mocap::options(),
      .open = mocap::open,
      .make_decoder = mocap::make_decoder,
      .describe = mocap::describe,
      .expect = mocap::expect,
      .make_layout = mocap::make_layout,
      .emulate = mocap::emulate};
  return driver;
}

}  // namespace posed::drivers
