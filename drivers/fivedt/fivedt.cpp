#include "drivers/fivedt/fivedt.hpp"

#include <algorithm>

#include "drivers/fivedt/decoder.hpp"
#include "drivers/fivedt/emulator.hpp"
#include "drivers/fivedt/start.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace fivedt {
namespace {

constexpr std::string_view kName = "fivedt";
constexpr double kSilence_s = 2.0;  // as in VRPN
constexpr std::uint16_t kVendor = 0x5D70;
constexpr std::int64_t kMaxPoll_hz = 200;  // limit of 19200 baud for nine bytes and the request
constexpr std::array<std::string_view, 2> kModes{"stream", "poll"};
constexpr std::array<std::string_view, 2> kKitPorts{"a", "b"};

struct GloveSettings {
  Side side = Side::kRight;
  Settings settings;
};

Result<GloveSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, kName, identity);
  GloveSettings glove;
  glove.side = reader.side();
  glove.settings.form = static_cast<Form>(reader.choice("model", kFormNames));
  glove.settings.polled = reader.choice("mode", kModes) == 1;
  glove.settings.port_b = reader.choice("kit_port", kKitPorts) == 1;
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  return glove;
}

std::string device_info_of(const GloveSettings& glove) {
  const Settings& settings = glove.settings;
  return std::string(kName) + " hand=" + std::string(glove::side_name(glove.side)) +
         " model=" + std::string(kFormNames[static_cast<std::size_t>(settings.form)]) +
         " mode=" + std::string(kModes[settings.polled ? 1 : 0]) +
         " kit_port=" + std::string(kKitPorts[settings.port_b ? 1 : 0]);
}

Result<GloveSettings> from_options(const Options& options) {
  const auto side = glove::hand_option(options);
  if (!side) return std::unexpected(side.error());
  const auto model =
      std::ranges::find(kFormNames, std::string_view(option<std::string>(options, "model")));
  if (model == kFormNames.end()) {
    return misuse(
        "model should be \"5\", \"5-wireless\", \"16\", \"ultra-wireless\", "
        "\"ultra-usb-5\" or \"ultra-usb-14\"");
  }
  const auto form = static_cast<Form>(model - kFormNames.begin());
  const auto poll_hz = option<std::int64_t>(options, "poll_hz");
  if (poll_hz < 0 || poll_hz > kMaxPoll_hz || (poll_hz > 0 && form != Form::kFive)) {
    return misuse("poll_hz should be 0 (stream) to 200; only model = \"5\" can be polled");
  }
  const auto& kit_port = option<std::string>(options, "kit_port");
  const auto port = std::ranges::find(kKitPorts, std::string_view(kit_port));
  if (port == kKitPorts.end()) return misuse("kit_port should be \"a\" or \"b\"");
  return GloveSettings{
      .side = *side,
      .settings = {.form = form, .polled = poll_hz > 0, .port_b = port != kKitPorts.begin()}};
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto glove = read_device_info(text, identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = fivedt::model(glove->settings.form);
  if (!model) return std::unexpected(model.error());
  return Description{.driver = std::string(kName),
                     .text = text,
                     .identity = identity,
                     .skeleton = std::make_shared<Skeleton>(hand_skeleton(glove->side)),
                     .samples = layout(*model, glove->settings.form),
                     .rate_hz = 0.0};
}

// The usual baud rate of a model, when the options give none.
std::int64_t usual_baud(Form form) {
  if (form == Form::kFiveWireless) return 9600;
  return form == Form::kUltraWireless ? 115200 : 19200;
}

Options with_baud(Options options, const GloveSettings& glove) {
  if (option<std::int64_t>(options, "baud") == 0) {
    options["baud"] = usual_baud(glove.settings.form);
  }
  return options;
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(fivedt_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  if (!is_usb(glove->settings.form)) {
    const auto sound = glove::check_connection(with_baud(*options, *glove));
    if (!sound) return std::unexpected(sound.error());
  }
  return describe(device_info_of(*glove), option<std::string>(*options, "id"));
}

Result<glove::Model> glove_model(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  return model(glove->settings.form);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = fivedt::model(glove->settings.form);
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<FiveDtDecoder>(description.skeleton, std::move(*calibration),
                                         glove->settings);
}

// Bits of the product id: bit 0 is a left hand, 1 and 2 a wireless kit and its port B, 4 five
// sensors.
std::vector<std::uint16_t> products(const GloveSettings& glove) {
  const int base =
      (glove.side == Side::kLeft ? 0x01 : 0) | (glove.settings.form == Form::kUltraUsb5 ? 0x10 : 0);
  const auto product = [base](int bits) { return static_cast<std::uint16_t>(base | bits); };
  return {product(0), product(0x02), product(0x06)};
}

Result<Connection> reach(const Options& options, const GloveSettings& glove,
                         TransportFactory& ports) {
  if (is_usb(glove.settings.form)) {
    return ports.hid({.vendor = kVendor,
                      .products = products(glove),
                      .id = option<std::string>(options, "id"),
                      .path = option<std::string>(options, "port")});
  }
  return glove::connect(with_baud(options, glove), ports, {});
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto options = complete_options(fivedt_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  auto link = reach(*options, *glove, ports);
  if (!link) return std::unexpected(link.error());
  auto warnings = start(*link, glove->side, glove->settings);
  if (!warnings) return std::unexpected(warnings.error());
  auto device = make_device(fivedt_driver(), device_info_of(*glove), link->identity());
  if (!device) return device;
  device->transport = is_usb(glove->settings.form) ? make_hid_transport(std::move(*link))
                                                   : make_link_transport(std::move(*link));
  device->warnings = std::move(*warnings);
  if (const auto poll_hz = option<std::int64_t>(*options, "poll_hz"); poll_hz > 0) {
    device->poll = {.request = {std::byte{'C'}}, .period_ns = 1'000'000'000 / poll_hz};
  }
  device->reopen_after_s = kSilence_s;
  return device;
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(fivedt_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  return std::make_unique<FiveDtEmulator>(glove->side, glove->settings);
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(0);
  options.back().help = "bits a second of the serial port; 0: what the model uses as a rule";
  options.push_back({.name = "model",
                     .default_value = std::string("5"),
                     .help = "5, 5-wireless, 16, ultra-wireless, ultra-usb-5 or ultra-usb-14"});
  options.push_back({.name = "poll_hz",
                     .default_value = std::int64_t{0},
                     .help = "model 5 is asked so often a second; 0: it streams"});
  options.push_back({.name = "kit_port",
                     .default_value = std::string("a"),
                     .help = "a or b: which glove of an Ultra Wireless kit"});
  return options;
}

}  // namespace
}  // namespace fivedt

const Driver& fivedt_driver() {
  static const glove::GloveTraits traits{.glove_model = fivedt::glove_model};
  static const Driver driver{.name = fivedt::kName,
                             .summary = "5DT data gloves: serial, Ultra Wireless and Ultra USB",
                             .options = fivedt::all_options(),
                             .open = fivedt::open,
                             .make_decoder = fivedt::make_decoder,
                             .describe = fivedt::describe,
                             .expect = fivedt::expect,
                             .glove = &traits,
                             .emulate = fivedt::emulate};
  return driver;
}

}  // namespace posed::drivers
