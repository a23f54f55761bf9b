#include "drivers/vmc/vmc.hpp"

#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "drivers/transport/udp_options.hpp"
#include "drivers/vmc/decoder.hpp"
#include "drivers/vmc/emulator.hpp"
#include "drivers/vmc/layout.hpp"
#include "drivers/vmc/protocol.hpp"

namespace posed::drivers {
namespace vmc {
namespace {

constexpr double kVmcRate_hz = 60.0;

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto rate_hz = parse_device_info(text, identity);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  return source_description("vmc", text, identity, *rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& /*description*/) {
  return std::make_unique<VmcDecoder>();
}

Result<Packing> packing_of(const Options& options) {
  const auto& word = option<std::string>(options, "packing");
  if (word == "bundle") return Packing::kOneBundle;
  if (word == "bundles") return Packing::kBundles;
  if (word == "messages") return Packing::kMessages;
  return misuse("packing should be bundle, bundles or messages");
}

Result<> check(const Options& options) {
  const double rate_hz = option<double>(options, "rate_hz");
  if (!parse_device_info(device_info_text(rate_hz), "")) {
    return misuse("rate_hz should be more than 0 and at most 1000");
  }
  if (const auto packing = packing_of(options); !packing) return std::unexpected(packing.error());
  return check_udp(udp_settings(options));
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(vmc_driver(), given);
  if (!options) return std::unexpected(options.error());
  if (const auto ok = check(*options); !ok) return std::unexpected(ok.error());
  return describe(device_info_text(option<double>(*options, "rate_hz")),
                  "udp " + option<std::string>(*options, "listen"));
}

// UDP has no connection: the socket opens whether or not the performer is there.
Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  auto transport = ports.udp(udp_settings(*complete_options(vmc_driver(), given)));
  if (!transport) return std::unexpected(transport.error());
  return make_device(vmc_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(vmc_driver(), given);
  if (!options) return std::unexpected(options.error());
  if (const auto ok = check(*options); !ok) return std::unexpected(ok.error());
  return std::make_unique<VmcEmulator>(option<double>(*options, "rate_hz"), *packing_of(*options));
}

std::vector<OptionSpec> options() {
  auto specs = udp_options("127.0.0.1:39539");
  specs.push_back({.name = "rate_hz",
                   .default_value = kVmcRate_hz,
                   .help = "frames a second that the performer is set to"});
  specs.push_back({.name = "packing",
                   .default_value = std::string("bundle"),
                   .help = "of the emulator: a frame as one 'bundle', as 'bundles' of at most "
                           "1,472 bytes, or as single 'messages'; posed reads them all"});
  return specs;
}

}  // namespace
}  // namespace vmc

const Driver& vmc_driver() {
  static const Driver driver{.name = "vmc",
                             .summary =
                                 "a VMC performer: an avatar's bones, blend shapes and trackers as "
                                 "OSC over UDP (Virtual Motion Capture, VSeeFace, SlimeVR and "
                                 "others)",
                             .options = vmc::options(),
                             .open = vmc::open,
                             .make_decoder = vmc::make_decoder,
                             .describe = vmc::describe,
                             .expect = vmc::expect,
                             .make_layout = vmc::make_layout,
                             .emulate = vmc::emulate};
  return driver;
}

}  // namespace posed::drivers
