#include "drivers/p5/p5.hpp"

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/p5/decoder.hpp"
#include "drivers/p5/device_info.hpp"
#include "drivers/p5/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace p5 {
namespace {

constexpr std::string_view kName = "p5";
constexpr std::uint16_t kVendor = 0x0D7F;
constexpr std::uint16_t kProduct = 0x0100;
constexpr int kInterface = 1;  // of two interfaces, the one that is not a mouse

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto glove = read_device_info(text, identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = p5::model();
  if (!model) return std::unexpected(model.error());
  return Description{.driver = std::string(kName),
                     .text = text,
                     .identity = identity,
                     .skeleton = std::make_shared<Skeleton>(hand_skeleton(glove->side)),
                     .samples = layout(*model),
                     .rate_hz = 0.0};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto side = glove::hand_option(*options);
  if (!side) return std::unexpected(side.error());
  const GloveSettings unknown{.side = *side, .firmware = {}, .heads = {}, .leds = {}};
  return describe(device_info_of(unknown), option<std::string>(*options, "id"));
}

Result<glove::Model> glove_model(const Description& /*description*/) { return model(); }

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = p5::model();
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<P5Decoder>(description.skeleton, std::move(*calibration), glove->rig());
}

// Reads a complete feature report; returns empty with a warning when the glove does not send it.
std::vector<std::byte> feature(UsbLink& link, std::uint8_t number, std::size_t bytes,
                               std::vector<std::string>& warnings) {
  auto report = link.feature(number, bytes);
  if (report && report->size() == bytes && (*report)[0] == std::byte{number}) return *report;
  warnings.push_back("the glove does not send its feature report " + std::to_string(number) +
                     (number == kFirmwareReport ? "" : "; the position of the hand stays unknown"));
  return {};
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto side = glove::hand_option(*options);
  if (!side) return std::unexpected(side.error());
  auto link = ports.usb({.vendor = kVendor,
                         .product = kProduct,
                         .id = option<std::string>(*options, "id"),
                         .interface = kInterface,
                         .report_bytes = kReportBytes});
  if (!link) return std::unexpected(link.error());
  std::vector<std::string> warnings;
  GloveSettings glove{.side = *side, .firmware = {}, .heads = {}, .leds = {}};
  glove.firmware = feature(*link, kFirmwareReport, kFirmwareBytes, warnings);
  glove.heads = feature(*link, kHeadsReport, kHeadsBytes, warnings);
  glove.leds = feature(*link, kLedsReport, kLedsBytes, warnings);
  auto device = make_device(p5_driver(), device_info_of(glove), link->identity());
  if (!device) return device;
  // An idle device sends no reports, so silence is no reason to reopen it.
  device->transport = make_usb_transport(std::move(*link));
  device->warnings = std::move(warnings);
  return device;
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  return std::make_unique<P5Emulator>();
}

}  // namespace
}  // namespace p5

const Driver& p5_driver() {
  static const glove::GloveTraits traits{.glove_model = p5::glove_model};
  static const Driver driver{
      .name = p5::kName,
      .summary = "Essential Reality P5, over libusb",
      .options = {{.name = "id",
                   .default_value = std::string(),
                   .help = "USB port path, as posed devices lists it; left out: the only one"},
                  {.name = "hand",
                   .default_value = std::string("right"),
                   .help = "right or left: which hand wears it"}},
      .open = p5::open,
      .make_decoder = p5::make_decoder,
      .describe = p5::describe,
      .expect = p5::expect,
      .glove = &traits,
      .emulate = p5::emulate};
  return driver;
}

}  // namespace posed::drivers
