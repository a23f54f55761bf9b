#include "drivers/template/template.hpp"

#include <cmath>
#include <numbers>

#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/template/decoder.hpp"
#include "drivers/template/protocol.hpp"
#include "drivers/transport/file.hpp"

namespace posed::drivers {
namespace bend {
namespace {

constexpr double kDefaultRate_hz = 100.0;
constexpr double kHand_m = 0.09;    // wrist to knuckle
constexpr double kFinger_m = 0.08;  // knuckle to tip

Result<std::shared_ptr<const Skeleton>> finger_skeleton() {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = "bend-finger";
  Joint palm;
  palm.name = "palm";
  Joint finger;
  finger.name = "finger";
  finger.parent = 0;
  finger.offset_m = {kHand_m, 0.0, 0.0};  // a left hand in T-pose points to +X
  finger.end_site_m = Eigen::Vector3d(kFinger_m, 0.0, 0.0);
  skeleton->joints = {palm, finger};
  skeleton->channels = {{.joint = 1, .axis = Axis::kZ}};
  if (auto ok = skeleton->finish(); !ok) return std::unexpected(ok.error());
  return skeleton;
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto rate_hz = parse_device_info(text, identity);
  if (!rate_hz) return std::unexpected(rate_hz.error());
  const auto skeleton = finger_skeleton();
  if (!skeleton) return std::unexpected(skeleton.error());
  return Description{.driver = "template",
                     .text = text,
                     .identity = identity,
                     .skeleton = *skeleton,
                     .samples = {.names = {"bend", "battery"}, .units = {"rad", "1"}},
                     .rate_hz = *rate_hz};
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  return std::make_unique<BendDecoder>(description.skeleton, description.rate_hz);
}

// A finger that closes and opens once per turn of the packet counter, so that it loops smoothly. A
// real driver would open its port here and read the device info from it.
Chunks simulated_packets() {
  constexpr int kPackets = 256;
  constexpr double kHalfRange_rad = 0.7;
  Chunks chunks;
  for (int i = 0; i < kPackets; ++i) {
    const double phase = 2.0 * std::numbers::pi * i / kPackets;
    chunks.add(
        encode_packet({.count = static_cast<std::uint8_t>(i),
                       .bend_rad = static_cast<float>(kHalfRange_rad * (1.0 - std::cos(phase))),
                       .battery = 0.8F}));
  }
  return chunks;
}

Result<Device> open(const Options& given, TransportFactory& /*ports*/) {
  const auto options = complete_options(template_driver(), given);
  if (!options) return std::unexpected(options.error());
  const double rate_hz = option<double>(*options, "rate_hz");
  auto device = make_device(template_driver(), device_info_text(rate_hz), "simulated");
  if (!device) return misuse("rate_hz should be more than 0 and at most 1000000");
  auto transport = FileTransport::open(simulated_packets(), {.rate_hz = rate_hz});
  if (!transport) return std::unexpected(transport.error());
  device->transport = std::move(*transport);
  return device;
}

}  // namespace
}  // namespace bend

const Driver& template_driver() {
  static const Driver driver{
      .name = "template",
      .summary = "a simulated bend sensor on one finger; copy its folder to begin a driver",
      .options = {{.name = "rate_hz",
                   .default_value = bend::kDefaultRate_hz,
                   .help = "packets a second"}},
      .open = bend::open,
      .make_decoder = bend::make_decoder,
      .describe = bend::describe};
  return driver;
}

}  // namespace posed::drivers
