#include "drivers/lucidgloves/lucidgloves.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/lucidgloves/decoder.hpp"
#include "drivers/lucidgloves/emulator.hpp"
#include "drivers/lucidgloves/start.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace lucidgloves {
namespace {

constexpr std::string_view kName = "lucidgloves";
constexpr std::int64_t kBaud = 115200;
constexpr std::string_view kListen = "127.0.0.1:65432";
constexpr double kSilence_s = 2.0;  // the firmware streams all the time
constexpr std::int64_t kForceRange = 1000;
constexpr std::int64_t kMaxForceRange = 65535;

struct GloveSettings {
  Side side = Side::kRight;
  Settings settings;
};

Result<GloveSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, kName, identity);
  GloveSettings glove;
  glove.side = reader.side();
  glove.settings.encoding = static_cast<Encoding>(reader.choice("encoding", kEncodingNames));
  glove.settings.max_analog = reader.whole("max", 1, kMaxAnalog);
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  return glove;
}

std::string device_info_of(const GloveSettings& glove) {
  const auto encoding = static_cast<std::size_t>(glove.settings.encoding);
  return std::string(kName) + " hand=" + std::string(glove::side_name(glove.side)) +
         " encoding=" + std::string(kEncodingNames[encoding]) +
         " max=" + std::to_string(glove.settings.max_analog);
}

Result<GloveSettings> from_options(const Options& options) {
  const auto side = glove::hand_option(options);
  if (!side) return std::unexpected(side.error());
  const auto& encoding = option<std::string>(options, "encoding");
  const auto at = std::ranges::find(kEncodingNames, std::string_view(encoding));
  if (at == kEncodingNames.end()) {
    return misuse("encoding should be \"auto\", \"alpha\" or \"legacy\"");
  }
  const auto max = option<std::int64_t>(options, "max_analog_value");
  if (max < 1 || max > kMaxAnalog) {
    return misuse("max_analog_value should be 1 to 65535; it is 4095 on an ESP32, 1023 on an AVR");
  }
  return GloveSettings{.side = *side,
                       .settings = {.encoding = static_cast<Encoding>(at - kEncodingNames.begin()),
                                    .max_analog = static_cast<int>(max)}};
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto glove = read_device_info(text, identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = lucidgloves::model(glove->settings);
  if (!model) return std::unexpected(model.error());
  return Description{.driver = std::string(kName),
                     .text = text,
                     .identity = identity,
                     .skeleton = std::make_shared<Skeleton>(hand_skeleton(glove->side)),
                     .samples = glove::sample_layout(*model, extra_names()),
                     .rate_hz = 0.0};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(lucidgloves_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  if (auto sound = glove::check_connection(*options); !sound) return std::unexpected(sound.error());
  return describe(device_info_of(*glove), option<std::string>(*options, "id"));
}

Result<glove::Model> glove_model(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  return model(glove->settings);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = lucidgloves::model(glove->settings);
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<LucidDecoder>(description.skeleton, std::move(*calibration),
                                        glove->settings);
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto options = complete_options(lucidgloves_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  auto link = glove::connect(*options, ports, {kUsbIds.begin(), kUsbIds.end()});
  if (!link) return std::unexpected(link.error());
  const auto started = start(*link, glove->side, glove->settings);
  if (!started) return std::unexpected(started.error());
  auto device = make_device(lucidgloves_driver(), device_info_of(*glove), link->identity());
  if (!device) return device;
  device->transport = make_link_transport(std::move(*link));
  device->reopen_after_s = kSilence_s;
  return device;
}

Result<std::vector<std::byte>> encode_haptics(const Options& given, const glove::Haptics& haptics) {
  const auto options = complete_options(lucidgloves_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  const auto range = option<std::int64_t>(*options, "force_range");
  if (range < 1 || range > kMaxForceRange) {
    return misuse("force_range should be 1 to 65535; it is 1000, or 4095 for senseshift's library");
  }
  Forces forces{};
  for (std::size_t f = 0; f < kFingers; ++f) {
    const float force = haptics.force[f];
    if (!(force <= 1.0F)) return misuse("a force should be 0 (free) to 1 (blocked)");
    forces[f] =
        force < 0.0F ? -1 : static_cast<int>(std::lround(force * static_cast<float>(range)));
  }
  const Encoding encoding = glove->settings.encoding;
  std::string text = force_line(forces, encoding);
  if (haptics.vibration_s != 0.0F) {
    const bool sound = haptics.vibration_s > 0.0F && haptics.vibration_s <= 60.0F &&
                       haptics.vibration_hz >= 0.0F && haptics.vibration_hz <= 10'000.0F &&
                       haptics.vibration >= 0.0F && haptics.vibration <= 1.0F;
    if (!sound) return misuse("a vibration lasts up to 60 s, at up to 10000 Hz, strength 0 to 1");
    if (encoding == Encoding::kLegacy) {
      return misuse("gloves with the legacy encoding cannot vibrate; send forces only");
    }
    text += vibration_line(haptics.vibration_hz, haptics.vibration_s, haptics.vibration);
  }
  const auto bytes = std::as_bytes(std::span(text));
  return std::vector(bytes.begin(), bytes.end());
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete_options(lucidgloves_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto glove = from_options(*options);
  if (!glove) return std::unexpected(glove.error());
  return std::make_unique<LucidEmulator>(glove->side, glove->settings.encoding,
                                         glove->settings.max_analog);
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(kBaud);
  for (OptionSpec& tcp : glove::tcp_options(kListen)) options.push_back(std::move(tcp));
  options.push_back({.name = "encoding",
                     .default_value = std::string("auto"),
                     .help = "auto, alpha or legacy: how the glove writes its lines"});
  options.push_back({.name = "max_analog_value",
                     .default_value = std::int64_t{4095},
                     .help = "value of a closed finger: 4095 on an ESP32, 1023 on an AVR board"});
  options.push_back({.name = "force_range",
                     .default_value = kForceRange,
                     .help = "value of a blocked finger: 1000, or 4095 for senseshift's library"});
  return options;
}

}  // namespace
}  // namespace lucidgloves

const Driver& lucidgloves_driver() {
  static const glove::GloveTraits traits{.glove_model = lucidgloves::glove_model,
                                         .encode_haptics = lucidgloves::encode_haptics};
  static const Driver driver{
      .name = lucidgloves::kName,
      .summary = "LucidGloves and others that speak OpenGloves, over a serial port or TCP",
      .options = lucidgloves::all_options(),
      .open = lucidgloves::open,
      .make_decoder = lucidgloves::make_decoder,
      .describe = lucidgloves::describe,
      .expect = lucidgloves::expect,
      .glove = &traits,
      .emulate = lucidgloves::emulate};
  return driver;
}

}  // namespace posed::drivers
