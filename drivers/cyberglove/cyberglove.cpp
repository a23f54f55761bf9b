// The cyberglove driver: CyberGlove I, II and III over a serial port, and III over Wi-Fi.
#include <algorithm>
#include <bit>
#include <cmath>

#include "drivers/cyberglove/decoder.hpp"
#include "drivers/cyberglove/emulator.hpp"
#include "drivers/cyberglove/start.hpp"
#include "drivers/glove/glove_type.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace cyberglove {
namespace {

// A III has an FTDI chip with that chip's default id (see its user guide); the dongles of the II
// have other ids.
constexpr std::array<KnownUsb, 1> kFtdi{
    KnownUsb{.vendor = 0x0403, .product = 0x6001, .adapter = true}};
constexpr std::array<std::string_view, 2> kForms{"8bit", "16bit"};           // as Form
constexpr std::array<std::string_view, 3> kModes{"stream", "poll", "sync"};  // as Mode
constexpr double kMaxSampleRate_hz = 1000.0;
constexpr double kSilence_s = 1.0;
constexpr std::int64_t kTicksAFrame = 3840;  // 1/115200 s in one of 30 frames per second
// Longer than the period of any rate that the options allow.
constexpr int kMaxTicks = 65535 * 1024;

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

Result<> set_rate(double rate_hz, RequestedConfig& requested) {
  if (!(rate_hz >= 0.0 && rate_hz <= kMaxSampleRate_hz) || (rate_hz > 0.0 && rate_hz < 1.0)) {
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
  requested.ticks = ticks_of(requested);
  return {};
}

Poll poll_of(const RequestedConfig& requested) {
  if (requested.layout.mode != Mode::kPoll) return {};
  const std::string_view request = requested.layout.form == Form::k8Bit ? "G" : "1G";
  const auto bytes = std::as_bytes(std::span(request));
  return {.request = {bytes.begin(), bytes.end()},
          .period_ns = std::llround(1e9 * static_cast<double>(requested.ticks) / kTicks_hz)};
}

}  // namespace

std::string device_info_of(const RequestedConfig& settings) {
  const Layout& layout = settings.layout;
  return glove::hand_info("cyberglove", settings.hand) +
         " sensors=" + std::to_string(std::popcount(layout.mask)) +
         " mask=" + std::to_string(layout.mask) +
         " form=" + std::string(kForms[static_cast<std::size_t>(layout.form)]) +
         " mode=" + std::string(kModes[static_cast<std::size_t>(layout.mode)]) +
         " time=" + (layout.time ? "1" : "0") + " status=" + (layout.status ? "1" : "0") +
         " ticks=" + std::to_string(settings.ticks) +
         " multiplier=" + std::to_string(layout.multiplier);
}

namespace {

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(115200);
  for (OptionSpec& tcp : glove::tcp_options("127.0.0.1:5200")) options.push_back(std::move(tcp));
  options.push_back({.name = "form",
                     .default_value = std::string("8bit"),
                     .help = "8bit, or 16bit for the records of a CyberGlove III",
                     .words = kForms});
  options.push_back({.name = "mode",
                     .default_value = std::string("stream"),
                     .help = "stream; poll asks for each sample; sync waits for the box's input",
                     .words = kModes});
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

struct CyberGlove : glove::GloveType<CyberGlove> {
  using Settings = RequestedConfig;
  static constexpr std::string_view kName = "cyberglove";
  static constexpr std::string_view kSummary = "CyberGlove I, II and III over a serial port or TCP";
  static constexpr std::span<const KnownUsb> kUsb = kFtdi;
  static constexpr auto option_specs = all_options;

  static Result<Settings> settings(const Options& options) {
    const auto hand = TRY(glove::hand_option(options));
    RequestedConfig requested{
        .hand = hand,
        .sensors = static_cast<int>(option<std::int64_t>(options, "sensors")),
        .layout = {.form = static_cast<Form>(choice_option(options, "form", kForms)),
                   .mode = static_cast<Mode>(choice_option(options, "mode", kModes)),
                   .mask = kMask22,
                   .time = option<bool>(options, "time"),
                   .multiplier = 1},
        .filter = option<bool>(options, "filter"),
        .over_tcp = option<std::string>(options, "link") == "tcp",
        .baud = option<std::int64_t>(options, "baud")};
    if (requested.sensors == 18) requested.layout.mask = kMask18;
    TRY(set_rate(option<double>(options, "rate_hz"), requested));
    return requested;
  }
  static constexpr auto device_info = device_info_of;
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    glove::DeviceInfoReader reader(text, kName, identity);
    Settings glove{.hand = reader.side()};
    const int sensors = reader.whole("sensors", 1, static_cast<int>(kSensors));
    glove.layout.mask =
        static_cast<std::uint32_t>(reader.whole("mask", 1, static_cast<int>(kAllSensors)));
    glove.layout.form = static_cast<Form>(reader.choice("form", kForms));
    glove.layout.mode = static_cast<Mode>(reader.choice("mode", kModes));
    glove.layout.time = reader.whole("time", 0, 1) == 1;
    glove.layout.status = reader.whole("status", 0, 1) == 1;
    glove.ticks = reader.whole("ticks", 0, kMaxTicks);
    glove.layout.multiplier = reader.whole("multiplier", 1, kMaxMultiplier);
    TRY(reader.finish());
    if (std::popcount(glove.layout.mask) == sensors) return glove;
    return fail(
        "the device info of a 'cyberglove' and its mask have different numbers of sensors; the log "
        "is damaged",
        identity);
  }
  static Result<glove::Model> model(const Settings& settings) {
    return cyberglove::glove_model(settings.hand);
  }
  static std::vector<std::string> extra_names() { return {"switch", "light"}; }
  static double rate_hz(const Settings& settings) {
    return settings.ticks == 0 ? 0.0 : kTicks_hz / static_cast<double>(settings.ticks);
  }
  static std::unique_ptr<Decoder> make_decoder(
      const Settings& settings, std::shared_ptr<const Skeleton> skeleton,
      std::shared_ptr<const glove::Calibration> calibration) {
    if (settings.layout.form == Form::k16Bit) {
      return std::make_unique<Decoder16>(std::move(skeleton), std::move(calibration), settings.hand,
                                         settings.layout);
    }
    return std::make_unique<Decoder8>(std::move(skeleton), std::move(calibration), settings.hand,
                                      settings.layout);
  }
  static Result<Opened> open(const Options& options, Settings& settings, TransportFactory& ports) {
    auto link = TRY(glove::connect(options, ports, kFtdi));
    const auto layout = TRY(start(link, settings));
    settings.layout = layout;
    Opened opened = glove::opened(std::move(link), kSilence_s);
    opened.poll = poll_of(settings);
    return opened;
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    const bool is_iii = settings.layout.form == Form::k16Bit;
    return CyberGloveEmulator::make(
        {.hand = settings.hand,
         .mask = settings.layout.mask,
         .level_one = is_iii,
         .info = is_iii ? "CyberGlove III, Version 3.0" : "CyberGlove II, Version 2.1"});
  }
  // The motors can only shake; they cannot hold a finger. So a force sets how strongly a finger's
  // motor shakes. A vibration is refused, because posed would have to end it after its duration.
  static Result<std::vector<std::byte>> encode_haptics(const Options& /*options*/,
                                                       const Settings& settings,
                                                       const glove::Haptics& haptics) {
    if (settings.layout.form == Form::k16Bit) return misuse("CyberTouch goes with form = \"8bit\"");
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
};

}  // namespace
}  // namespace cyberglove

const Driver& cyberglove_driver() { return DriverOf<cyberglove::CyberGlove>::get(); }

}  // namespace posed::drivers
