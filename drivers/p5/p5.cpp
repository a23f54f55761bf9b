// The p5 driver: the Essential Reality P5, over libusb.
#include <charconv>

#include "drivers/glove/glove_type.hpp"
#include "drivers/p5/decoder.hpp"
#include "drivers/p5/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace p5 {
namespace {

// libp5glove's ids. The kernel's HID layer ignores the glove, so there is no hidraw node.
constexpr std::array<KnownUsb, 1> kP5Usb{
    KnownUsb{.bus = Bus::kUsb, .vendor = 0x0D7F, .product = 0x0100}};
constexpr int kInterface = 1;  // of two interfaces, the one that is not a mouse

constexpr std::string_view kNone = "none";

std::string hex_of(const std::vector<std::byte>& bytes) {
  if (bytes.empty()) return std::string(kNone);
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{0xF})];
  }
  return text;
}

// Returns false when the text is not this report, complete.
bool read_hex(const std::string& text, std::uint8_t number, std::size_t size,
              std::vector<std::byte>& bytes) {
  if (text == kNone) return true;
  if (text.size() != 2 * size) return false;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    unsigned value = 0;
    const char* const end = text.data() + i + 2;
    const auto [stop, error] = std::from_chars(text.data() + i, end, value, 16);
    if (error != std::errc() || stop != end) return false;
    bytes.push_back(static_cast<std::byte>(value));
  }
  return bytes[0] == std::byte{number};
}

}  // namespace

Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, "p5", identity);
  Settings settings{.hand = reader.side()};
  const std::string firmware = reader.word("firmware");
  const std::string heads = reader.word("heads");
  const std::string leds = reader.word("leds");
  TRY(reader.finish());
  if (!read_hex(firmware, kFirmwareReport, kFirmwareBytes, settings.firmware) ||
      !read_hex(heads, kHeadsReport, kHeadsBytes, settings.heads) ||
      !read_hex(leds, kLedsReport, kLedsBytes, settings.leds)) {
    return fail("the device info of a 'p5' has an invalid feature report; the log is damaged",
                identity);
  }
  return settings;
}

std::string device_info_of(const Settings& settings) {
  return glove::hand_info("p5", settings.hand) + " firmware=" + hex_of(settings.firmware) +
         " heads=" + hex_of(settings.heads) + " leds=" + hex_of(settings.leds);
}

namespace {

// Reads a complete feature report; returns empty with a warning when the glove does not send it.
std::vector<std::byte> feature(UsbLink& link, std::uint8_t number, std::size_t bytes,
                               std::vector<std::string>& warnings) {
  auto report = link.feature(number, bytes);
  if (report && report->size() == bytes && (*report)[0] == std::byte{number}) return *report;
  warnings.push_back("the glove does not send its feature report " + std::to_string(number) +
                     (number == kFirmwareReport ? "" : "; the position of the hand stays unknown"));
  return {};
}

struct P5 : glove::GloveType<P5> {
  using Settings = p5::Settings;
  static constexpr std::string_view kName = "p5";
  static constexpr std::string_view kSummary = "Essential Reality P5, over libusb";
  static constexpr std::span<const KnownUsb> kUsb = kP5Usb;

  static std::vector<OptionSpec> option_specs() {
    return {{.name = "id",
             .default_value = std::string(),
             .help = "USB port path, as posed devices lists it; left out: the only one"},
            {.name = "hand",
             .default_value = std::string("right"),
             .help = "right or left: which hand wears it"}};
  }
  static Result<Settings> settings(const Options& options) {
    const auto hand = TRY(glove::hand_option(options));
    return Settings{.hand = hand};
  }
  static Result<std::string> check(const Options& options, const Settings& /*settings*/) {
    return option<std::string>(options, "id");
  }
  static constexpr auto device_info = device_info_of;
  static constexpr auto parse_device_info = p5::parse_device_info;
  static Result<glove::Model> model(const Settings& /*settings*/) { return p5::model(); }
  static SampleLayout layout(const glove::Model& model, const Settings& /*settings*/) {
    return p5::layout(model);
  }
  static std::unique_ptr<Decoder> make_decoder(
      const Settings& settings, std::shared_ptr<const Skeleton> skeleton,
      std::shared_ptr<const glove::Calibration> calibration) {
    return std::make_unique<P5Decoder>(std::move(skeleton), std::move(calibration), settings.rig());
  }
  static Result<Opened> open(const Options& options, Settings& settings, TransportFactory& ports) {
    auto link = TRY(ports.usb({.vendor = kP5Usb[0].vendor,
                               .product = kP5Usb[0].product,
                               .id = option<std::string>(options, "id"),
                               .interface = kInterface,
                               .report_bytes = kReportBytes}));
    std::vector<std::string> warnings;
    settings.firmware = feature(link, kFirmwareReport, kFirmwareBytes, warnings);
    settings.heads = feature(link, kHeadsReport, kHeadsBytes, warnings);
    settings.leds = feature(link, kLedsReport, kLedsBytes, warnings);
    std::string identity = link.identity();
    // An idle device sends no reports, so silence is no reason to reopen it.
    return Opened{.identity = std::move(identity),
                  .transport = make_usb_transport(std::move(link)),
                  .warnings = std::move(warnings)};
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& /*settings*/) {
    return std::make_unique<P5Emulator>();
  }
};

}  // namespace
}  // namespace p5

const Driver& p5_driver() { return DriverOf<p5::P5>::get(); }

}  // namespace posed::drivers
