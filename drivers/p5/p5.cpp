#include "drivers/p5/p5.hpp"

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/options.hpp"
#include "drivers/p5/decoder.hpp"
#include "drivers/p5/emulator.hpp"
#include "drivers/p5/greeting.hpp"
#include "drivers/transport/ports.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace {

constexpr std::string_view kName = "p5";
constexpr std::uint16_t kVendor = 0x0D7F;
constexpr std::uint16_t kProduct = 0x0100;
constexpr int kInterface = 1;  // of two, the one that is no mouse

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto glove = p5::read_greeting(text, identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = p5::model();
  if (!model) return std::unexpected(model.error());
  return Description{.driver = std::string(kName),
                     .text = text,
                     .identity = identity,
                     .skeleton = std::make_shared<Skeleton>(hand_skeleton(glove->side)),
                     .samples = p5::layout(*model),
                     .rate_hz = 0.0};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto side = glove::hand_option(*options);
  if (!side) return std::unexpected(side.error());
  const p5::Greeted unknown{.side = *side, .firmware = {}, .heads = {}, .leds = {}};
  return describe(p5::greeting_of(unknown), option<std::string>(*options, "id"));
}

Result<glove::Model> glove_model(const Description& /*description*/) { return p5::model(); }

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto glove = p5::read_greeting(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = p5::model();
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<p5::P5Decoder>(description.skeleton, std::move(*calibration),
                                         glove->tower());
}

// A feature report, whole; empty with a warning when the glove does not give it.
std::vector<std::byte> feature(UsbLink& link, std::uint8_t number, std::size_t bytes,
                               std::vector<std::string>& warnings) {
  auto report = link.feature(number, bytes);
  if (report && report->size() == bytes && (*report)[0] == std::byte{number}) return *report;
  warnings.push_back("the glove does not give its feature report " + std::to_string(number) +
                     (number == p5::kFirmwareReport ? "" : "; where the hand is stays unknown"));
  return {};
}

Result<Device> open(const Options& given, Ports& ports) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto side = glove::hand_option(*options);
  if (!side) return std::unexpected(side.error());
  auto link = ports.usb({.vendor = kVendor,
                         .product = kProduct,
                         .id = option<std::string>(*options, "id"),
                         .interface = kInterface,
                         .report_bytes = p5::kReportBytes});
  if (!link) return std::unexpected(link.error());
  std::vector<std::string> warnings;
  p5::Greeted glove{.side = *side, .firmware = {}, .heads = {}, .leds = {}};
  glove.firmware = feature(*link, p5::kFirmwareReport, p5::kFirmwareBytes, warnings);
  glove.heads = feature(*link, p5::kHeadsReport, p5::kHeadsBytes, warnings);
  glove.leds = feature(*link, p5::kLedsReport, p5::kLedsBytes, warnings);
  auto description = describe(p5::greeting_of(glove), link->identity());
  if (!description) return std::unexpected(description.error());
  auto decoder = make_decoder(*description);
  if (!decoder) return std::unexpected(decoder.error());
  // A device that idles sends no reports: silence is no reason to open it anew.
  return Device{.description = std::move(*description),
                .transport = make_usb_transport(std::move(*link)),
                .decoder = std::move(*decoder),
                .warnings = std::move(warnings)};
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(p5_driver(), given);
  if (!options) return std::unexpected(options.error());
  return std::make_unique<p5::P5Emulator>();
}

}  // namespace

const Driver& p5_driver() {
  static const Driver driver{
      .name = kName,
      .summary = "Essential Reality P5, over libusb",
      .options = {{.name = "id",
                   .default_value = std::string(),
                   .help = "USB port path, as posed devices lists it; left out: the only one"},
                  {.name = "hand",
                   .default_value = std::string("right"),
                   .help = "right or left: which hand wears it"}},
      .open = open,
      .make_decoder = make_decoder,
      .describe = describe,
      .expect = expect,
      .glove_model = glove_model,
      .emulate = emulate};
  return driver;
}

}  // namespace posed::drivers
