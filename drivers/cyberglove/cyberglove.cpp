#include "drivers/cyberglove/cyberglove.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/cyberglove/decoder.hpp"
#include "drivers/cyberglove/device_info.hpp"
#include "drivers/cyberglove/emulator.hpp"
#include "drivers/cyberglove/start.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace cyberglove {
namespace {

// USB id of the III; the dongles of the II have other ids.
constexpr std::uint32_t kFtdi = 0x0403'6001;
constexpr double kMaxRate_hz = 1000.0;
constexpr double kSilence_s = 1.0;
constexpr std::int64_t kTicksAFrame = 3840;  // 1/115200 s in one of 30 frames per second

template <std::size_t N>
Result<std::size_t> choice(const Options& options, const std::string& name,
                           const std::array<std::string_view, N>& names) {
  const auto& given = option<std::string>(options, name);
  const auto at = std::ranges::find(names, std::string_view(given));
  if (at != names.end()) return static_cast<std::size_t>(at - names.begin());
  std::string known;
  for (const std::string_view one : names) known += (known.empty() ? "" : ", ") + std::string(one);
  return misuse(name + " should be one of " + known);
}

// Sets the III's frame rate: 30 per second, times a multiplier of at most 3 (the maker verified 100
// Hz), or one out of several frames.
void set_frames(double rate_hz, RequestedConfig& requested) {
  const double frames = rate_hz > 0.0 ? rate_hz / kFrames_hz : 3.0;
  requested.layout.multiplier = static_cast<int>(std::clamp(std::round(frames), 1.0, 3.0));
  requested.divider =
      static_cast<int>(std::clamp(std::round(1.0 / std::min(frames, 1.0)), 1.0, 255.0));
}

std::int64_t ticks_of(const RequestedConfig& requested) {
  if (requested.layout.form == Form::k8Bit) return requested.period.ticks();
  return kTicksAFrame * requested.divider / requested.layout.multiplier;
}

Result<RequestedConfig> requested_config(const Options& options) {
  const auto hand = glove::hand_option(options);
  if (!hand) return std::unexpected(hand.error());
  const auto form = choice(options, "form", kForms);
  if (!form) return std::unexpected(form.error());
  const auto mode = choice(options, "mode", kModes);
  if (!mode) return std::unexpected(mode.error());
  RequestedConfig requested{.hand = *hand,
                            .sensors = static_cast<int>(option<std::int64_t>(options, "sensors")),
                            .layout = {.form = static_cast<Form>(*form),
                                       .mode = static_cast<Mode>(*mode),
                                       .mask = kMask22,
                                       .time = option<bool>(options, "time"),
                                       .multiplier = 1},
                            .filter = option<bool>(options, "filter"),
                            .period = {},
                            .over_tcp = option<std::string>(options, "link") == "tcp",
                            .baud = option<std::int64_t>(options, "baud")};
  if (requested.sensors == 18) requested.layout.mask = kMask18;
  const auto rate_hz = option<double>(options, "rate_hz");
  if (!(rate_hz >= 0.0 && rate_hz <= kMaxRate_hz) || (rate_hz > 0.0 && rate_hz < 1.0)) {
    return misuse("rate_hz should be 1 to 1000, or 0 for as fast as the glove can");
  }
  if (requested.layout.mode == Mode::kPoll && rate_hz == 0.0) {
    return misuse("a polled glove needs a rate_hz above 0");
  }
  if (requested.layout.mode == Mode::kSync && requested.layout.form == Form::k16Bit) {
    return misuse("mode = \"sync\" goes with form = \"8bit\" only");
  }
  requested.period = period_of(rate_hz);
  if (requested.layout.form == Form::k16Bit) set_frames(rate_hz, requested);
  return requested;
}

Result<RequestedConfig> requested_config_of_given(const Options& given) {
  const auto options = complete_options(cyberglove_driver(), given);
  if (!options) return std::unexpected(options.error());
  return requested_config(*options);
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto glove = read_device_info(text, identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = glove_model(glove->hand);
  if (!model) return std::unexpected(model.error());
  const std::array<std::string, kExtras> extra_names{"switch", "light"};
  return Description{
      .driver = "cyberglove",
      .text = text,
      .identity = identity,
      .skeleton = std::make_shared<Skeleton>(hand_skeleton(glove->hand)),
      .samples = glove::sample_layout(*model, extra_names),
      .rate_hz = glove->ticks == 0 ? 0.0 : kTicks_hz / static_cast<double>(glove->ticks)};
}

Result<Description> expect(const Options& given) {
  const auto options = complete_options(cyberglove_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto requested = requested_config(*options);
  if (!requested) return std::unexpected(requested.error());
  if (auto sound = glove::check_connection(*options); !sound) return std::unexpected(sound.error());
  return describe(
      device_info_of(
          {.hand = requested->hand, .layout = requested->layout, .ticks = ticks_of(*requested)}),
      option<std::string>(*options, "id"));
}

Result<glove::Model> model_of(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  return glove_model(glove->hand);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto glove = read_device_info(description.text, description.identity);
  if (!glove) return std::unexpected(glove.error());
  const auto model = glove_model(glove->hand);
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  if (glove->layout.form == Form::k16Bit) {
    return std::make_unique<Decoder16>(description.skeleton, std::move(*calibration), glove->hand,
                                       glove->layout);
  }
  return std::make_unique<Decoder8>(description.skeleton, std::move(*calibration), glove->hand,
                                    glove->layout);
}

Poll poll_of(const RequestedConfig& requested) {
  if (requested.layout.mode != Mode::kPoll) return {};
  const std::string_view request = requested.layout.form == Form::k8Bit ? "G" : "1G";
  const auto bytes = std::as_bytes(std::span(request));
  return {.request = {bytes.begin(), bytes.end()},
          .period_ns = std::llround(1e9 * static_cast<double>(ticks_of(requested)) / kTicks_hz)};
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto options = complete_options(cyberglove_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto requested = requested_config(*options);
  if (!requested) return std::unexpected(requested.error());
  auto link = glove::connect(*options, ports, {kFtdi});
  if (!link) return std::unexpected(link.error());
  const auto layout = start(*link, *requested);
  if (!layout) return std::unexpected(layout.error());
  auto device = make_device(
      cyberglove_driver(),
      device_info_of({.hand = requested->hand, .layout = *layout, .ticks = ticks_of(*requested)}),
      link->identity());
  if (!device) return device;
  device->transport = make_link_transport(std::move(*link));
  device->poll = poll_of(*requested);
  device->reopen_after_s = kSilence_s;
  return device;
}

// The motors can only shake; they cannot hold a finger. So a force sets how strongly a finger's
// motor shakes. A vibration is refused, because posed would have to end it after its duration.
Result<std::vector<std::byte>> encode_haptics(const Options& given, const glove::Haptics& haptics) {
  const auto requested = requested_config_of_given(given);
  if (!requested) return std::unexpected(requested.error());
  if (requested->layout.form == Form::k16Bit) return misuse("CyberTouch goes with form = \"8bit\"");
  if (haptics.vibration_s != 0.0F) {
    return misuse("a CyberTouch shakes until the next command: send forces, and 0 to end them");
  }
  std::vector<std::byte> bytes{kTouch, std::byte{0}};
  for (std::size_t f = 0; f < kFingers; ++f) {
    const float force = haptics.force[f];
    if (!(force <= 1.0F)) return misuse("a force should be 0 (free) to 1");
    if (force < 0.0F) continue;
    bytes.push_back(static_cast<std::byte>(f));
    bytes.push_back(static_cast<std::byte>(std::lround(force * 255.0F)));
  }
  bytes[1] = static_cast<std::byte>((bytes.size() - 2) / 2);
  return bytes;
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto requested = requested_config_of_given(given);
  if (!requested) return std::unexpected(requested.error());
  const bool is_iii = requested->layout.form == Form::k16Bit;
  return CyberGloveEmulator::make(
      {.hand = requested->hand,
       .mask = requested->layout.mask,
       .level_one = is_iii,
       .info = is_iii ? "CyberGlove III, Version 3.0" : "CyberGlove II, Version 2.1"});
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(115200);
  for (OptionSpec& tcp : glove::tcp_options("127.0.0.1:5200")) options.push_back(std::move(tcp));
  options.push_back({.name = "form",
                     .default_value = std::string("8bit"),
                     .help = "8bit, or 16bit for the records of a CyberGlove III"});
  options.push_back({.name = "mode",
                     .default_value = std::string("stream"),
                     .help = "stream; poll asks for each sample; sync waits for the box's input"});
  options.push_back({.name = "rate_hz",
                     .default_value = 100.0,
                     .help = "samples a second; 0: as fast as the glove can"});
  options.push_back({.name = "time",
                     .default_value = true,
                     .help = "have the glove stamp its 8-bit samples with its own clock"});
  options.push_back(
      {.name = "filter", .default_value = true, .help = "the box's own digital filter"});
  options.push_back({.name = "sensors",
                     .default_value = std::int64_t{0},
                     .help = "18 or 22 to refuse a glove with another number; 0: any"});
  return options;
}

}  // namespace
}  // namespace cyberglove

const Driver& cyberglove_driver() {
  static const glove::GloveTraits traits{.glove_model = cyberglove::model_of,
                                         .encode_haptics = cyberglove::encode_haptics};
  static const Driver driver{.name = "cyberglove",
                             .summary = "CyberGlove I, II and III over a serial port or TCP",
                             .options = cyberglove::all_options(),
                             .open = cyberglove::open,
                             .make_decoder = cyberglove::make_decoder,
                             .describe = cyberglove::describe,
                             .expect = cyberglove::expect,
                             .glove = &traits,
                             .emulate = cyberglove::emulate};
  return driver;
}

}  // namespace posed::drivers
