// The lucidgloves driver: LucidGloves and other gloves that speak OpenGloves, over a serial port or
// TCP.
#include <chrono>
#include <cmath>

#include "drivers/glove/glove_type.hpp"
#include "drivers/lucidgloves/decoder.hpp"
#include "drivers/lucidgloves/emulator.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace lucidgloves {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// CP210x and CH340, the USB-serial bridges of ESP32 and Arduino boards that opengloves-driver looks
// for (it lists 1A86:7524, but a CH340 is 1A86:7523).
constexpr std::array<KnownUsb, 2> kUsbIds{
    KnownUsb{.vendor = 0x10C4, .product = 0xEA60, .adapter = true},
    KnownUsb{.vendor = 0x1A86, .product = 0x7523, .adapter = true}};

constexpr std::int64_t kBaud = 115200;
constexpr std::string_view kListen = "127.0.0.1:65432";
constexpr double kSilence_s = 2.0;  // the firmware streams all the time
constexpr double kMaxForceRange = 65535;

constexpr milliseconds kPatience{3000};  // for a line: an ESP32 starts in about a second
// For the answer to the info request; most firmware sends none.
constexpr milliseconds kInfoPatience{150};
constexpr milliseconds kOneRead{50};
constexpr std::string_view kAsk = "(ZA)Z\n";  // start the stream, and send your info

// Collects what a glove has sent so far.
struct Seen {
  glove::LineReader<kMaxLine> lines;
  bool any = false;
  bool hand = false;
  bool too_large = false;  // a line with a value above the range
  int is_right = -1;

  void accept(std::span<const std::byte> bytes, const Settings& settings) {
    any = any || !bytes.empty();
    lines.feed(
        bytes,
        [&](std::string_view text) {
          Line line;
          const Outcome outcome = parse_line(text, settings.encoding, settings.max_analog, line);
          too_large = too_large || outcome == Outcome::kOutOfRange;
          if (outcome != Outcome::kOk) return;
          hand = hand || line.has_hand();
          if (line.has_info[2]) is_right = line.info[2];
        },
        [] {});
  }
};

std::unexpected<Error> no_glove(const Connection& link, const Settings& settings,
                                const Seen& seen) {
  if (!seen.any) {
    return fail("the glove sends nothing; check that it is switched on, and its baud", link.name());
  }
  if (seen.too_large) {
    return fail(
        "the glove sends values above max_analog_value = " + std::to_string(settings.max_analog) +
            "; set it to what a closed finger sends: "
            "4095 of an ESP32, 1023 of an AVR board, twice that where a firmware scales",
        link.name());
  }
  return fail("what comes is no line of a LucidGlove; check baud, encoding and port", link.name());
}

// Waits a few seconds at most for a valid line, because a board that restarts when its port opens
// sends other text first. If possible, the link is left at the end of a line.
Result<> start(Connection& link, const Settings& settings) {
  TRY(link.write(kAsk));
  Seen seen;
  const auto begin = Clock::now();
  auto good = begin;  // when the first good line came
  for (;;) {
    const auto now = Clock::now();
    if (!seen.hand) good = now;
    const bool informed = seen.is_right >= 0 || now - good > kInfoPatience;
    if (seen.hand && informed && (!seen.lines.in_line() || now - good > 2 * kInfoPatience)) break;
    if (now - begin > kPatience) return no_glove(link, settings, seen);
    const auto bytes = TRY(link.read(kOneRead));
    seen.accept(bytes, settings);
  }
  const int wanted = settings.hand == Side::kRight ? 1 : 0;
  if (seen.is_right >= 0 && seen.is_right != wanted) {
    const std::string hand = wanted == 1 ? "left" : "right";
    return fail("this is a " + hand + " glove; set hand = \"" + hand + "\" or use the other one",
                link.name());
  }
  return {};
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(kBaud);
  for (OptionSpec& tcp : glove::tcp_options(kListen)) options.push_back(std::move(tcp));
  options.push_back({.name = "encoding",
                     .default_value = std::string("auto"),
                     .help = "auto, alpha or legacy: how the glove writes its lines",
                     .words = kEncodingNames});
  options.push_back({.name = "max_analog_value",
                     .default_value = std::int64_t{4095},
                     .help = "value of a closed finger: 4095 on an ESP32, 1023 on an AVR board",
                     .min = 1,
                     .max = kMaxAnalog});
  options.push_back({.name = "force_range",
                     .default_value = std::int64_t{1000},
                     .help = "value of a blocked finger: 1000, or 4095 for senseshift's library",
                     .min = 1,
                     .max = kMaxForceRange});
  return options;
}

struct LucidGlove : glove::GloveType<LucidGlove> {
  using Settings = lucidgloves::Settings;
  static constexpr std::string_view kName = "lucidgloves";
  static constexpr std::string_view kSummary =
      "LucidGloves and others that speak OpenGloves, over a serial port or TCP";
  static constexpr std::span<const KnownUsb> kUsb = kUsbIds;
  static constexpr auto option_specs = all_options;
  static constexpr auto model = lucidgloves::model;
  static constexpr auto extra_names = lucidgloves::extra_names;

  static Result<Settings> settings(const Options& options) {
    const auto hand = TRY(glove::hand_option(options));
    return Settings{
        .hand = hand,
        .encoding = static_cast<Encoding>(choice_option(options, "encoding", kEncodingNames)),
        .max_analog = static_cast<int>(option<std::int64_t>(options, "max_analog_value"))};
  }
  static std::string device_info(const Settings& settings) {
    return glove::hand_info(kName, settings.hand) +
           " encoding=" + std::string(kEncodingNames[static_cast<std::size_t>(settings.encoding)]) +
           " max=" + std::to_string(settings.max_analog);
  }
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    glove::DeviceInfoReader reader(text, kName, identity);
    Settings settings{.hand = reader.side()};
    settings.encoding = static_cast<Encoding>(reader.choice("encoding", kEncodingNames));
    settings.max_analog = reader.whole("max", 1, kMaxAnalog);
    TRY(reader.finish());
    return settings;
  }
  static std::unique_ptr<Decoder> make_decoder(
      const Settings& settings, std::shared_ptr<const Skeleton> skeleton,
      std::shared_ptr<const glove::Calibration> calibration) {
    return std::make_unique<LucidDecoder>(std::move(skeleton), std::move(calibration), settings);
  }
  static Result<Opened> open(const Options& options, const Settings& settings,
                             TransportFactory& ports) {
    auto link = TRY(glove::connect(options, ports, kUsbIds));
    if (auto started = start(link, settings); !started) {
      link.pause_host();  // another that shares its address gets its turn
      return std::unexpected(started.error());
    }
    return glove::opened(std::move(link), kSilence_s);
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<LucidEmulator>(settings);
  }
  static Result<std::vector<std::byte>> encode_haptics(const Options& options,
                                                       const Settings& settings,
                                                       const glove::Haptics& haptics) {
    const auto range = static_cast<float>(option<std::int64_t>(options, "force_range"));
    Forces forces{};
    for (std::size_t f = 0; f < kFingers; ++f) {
      const float force = haptics.force[f];
      if (!(force <= 1.0F)) return misuse("a force should be 0 (free) to 1 (blocked)");
      forces[f] = force < 0.0F ? -1 : static_cast<int>(std::lround(force * range));
    }
    const Encoding encoding = settings.encoding;
    std::string text = force_line(forces, encoding);
    if (haptics.vibration_s != 0.0F) {
      const bool valid = haptics.vibration_s > 0.0F && haptics.vibration_s <= 60.0F &&
                         haptics.vibration_hz >= 0.0F && haptics.vibration_hz <= 10'000.0F &&
                         haptics.vibration >= 0.0F && haptics.vibration <= 1.0F;
      if (!valid) return misuse("a vibration lasts up to 60 s, at up to 10000 Hz, strength 0 to 1");
      if (encoding == Encoding::kLegacy) {
        return misuse("gloves with the legacy encoding cannot vibrate; send forces only");
      }
      text += vibration_line(haptics.vibration_hz, haptics.vibration_s, haptics.vibration);
    }
    const auto bytes = std::as_bytes(std::span(text));
    return std::vector(bytes.begin(), bytes.end());
  }
};

}  // namespace
}  // namespace lucidgloves

const Driver& lucidgloves_driver() { return DriverOf<lucidgloves::LucidGlove>::get(); }

}  // namespace posed::drivers
