// The fivedt driver: 5DT data gloves over a serial port or, the Ultra, as a HID device.
#include <algorithm>
#include <chrono>

#include "drivers/fivedt/decoder.hpp"
#include "drivers/fivedt/emulator.hpp"
#include "drivers/glove/glove_type.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace fivedt {
namespace {

constexpr double kSilence_s = 2.0;   // as in VRPN
constexpr double kMaxPoll_hz = 200;  // limit of 19200 baud for nine bytes and the request
constexpr std::array<std::string_view, 2> kModes{"stream", "poll"};
constexpr std::array<std::string_view, 2> kKitPorts{"a", "b"};

// Every product of the vendor is a glove; bit 0 marks a left one (VRPN's 5dtUSB).
constexpr std::array<KnownUsb, 1> kUltraUsb{
    KnownUsb{.bus = Bus::kHid, .vendor = 0x5D70, .product_mask = 0, .left_bit = 1}};

using Bytes = std::vector<std::byte>;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPatience{2000};  // as in VRPN
constexpr milliseconds kOneRead{50};
constexpr milliseconds kQuiet{30};
constexpr int kPackets = 2;  // a wireless type gives its hand after the first packet

// Appends received bytes to `bytes` until `enough` of it; returns false on a timeout.
template <typename Enough>
Result<bool> collect(Connection& link, Bytes& bytes, const Enough& enough) {
  const auto begin = Clock::now();
  while (!enough()) {
    if (Clock::now() - begin > kPatience) return false;
    const auto more = TRY(link.read(kOneRead));
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  return true;
}

std::unexpected<Error> other_hand(const Connection& link, Side found) {
  const std::string name(glove::side_name(found));
  return fail("this is a " + name + " glove; set hand = \"" + name + "\" or use the other one",
              link.name());
}

// Starts a Data Glove 5 with a two-way cable: asks for its info, then starts the stream.
Result<> start_wired(Connection& link, Side hand, bool polled) {
  TRY(link.drain(kQuiet));
  TRY(link.write("A"));
  Bytes answer;
  const auto ready =
      TRY(collect(link, answer, [&] { return std::ranges::find(answer, kReady) != answer.end(); }));
  if (!ready) {
    return fail(
        "the glove does not answer; check that it is switched on and a Data Glove 5 at "
        "19200 baud, or choose model = \"5-wireless\" for one that only sends",
        link.name());
  }
  answer.clear();
  TRY(link.write("G"));
  constexpr std::array kMark{std::byte{'B'}, std::byte{'R'}};
  const auto info = [&] { return std::ranges::search(answer, kMark).begin(); };
  const auto whole = TRY(collect(link, answer, [&] {
    return answer.end() - info() >= static_cast<std::ptrdiff_t>(kInfoBytes);
  }));
  if (!whole) return fail("what answers is no 5DT Data Glove 5; check the port", link.name());
  const bool right = (info()[4] & std::byte{1}) != std::byte{0};
  if (right != (hand == Side::kRight)) {
    return other_hand(link, right ? Side::kRight : Side::kLeft);
  }
  return polled ? Result<>() : link.write("D");
}

// Counts what a streaming glove has sent so far.
class Received final : public Readings {
 public:
  void reading(const Reading& reading) noexcept override {
    if (reading.kind == Reading::Kind::kData) {
      ++packets;
    } else {
      info = true;
      right = reading.right;
    }
  }
  void outcome(Outcome /*outcome*/) noexcept override {}

  int packets = 0;
  bool info = false, right = false;
};

Result<std::vector<std::string>> await_stream(Connection& link, const Settings& settings) {
  Framer framer(settings.form);
  Received received;
  Bytes bytes;
  std::size_t fed = 0;
  const auto good = TRY(collect(link, bytes, [&] {
    framer.feed(std::span(bytes).subspan(fed), received);
    fed = bytes.size();
    return received.packets >= kPackets;
  }));
  if (!good) {
    return fail(bytes.empty()
                    ? "the glove sends nothing; check that it is switched on, its model and baud"
                    : "what comes is not of this model of 5DT glove; check model, baud and port",
                link.name());
  }
  const Side other = settings.hand == Side::kRight ? Side::kLeft : Side::kRight;
  if (received.info && received.right != (settings.hand == Side::kRight))
    return other_hand(link, other);
  std::vector<std::string> warnings;
  const int capability = framer.capability();
  if (capability >= 0 &&
      says_left(static_cast<std::byte>(capability)) != (settings.hand == Side::kLeft)) {
    const std::string name(glove::side_name(other));
    warnings.push_back("the glove seems to be a " + name + " one; if so, set hand = \"" + name +
                       "\"");
  }
  return warnings;
}

// Checks the model and the hand of a glove and starts its stream, which takes up to a few seconds.
// An error says what came instead, or that the glove is of the other hand. Returns warnings for
// users.
Result<std::vector<std::string>> start(Connection& link, const Settings& settings) {
  if (settings.form != Form::kFive) return await_stream(link, settings);
  TRY(start_wired(link, settings.hand, settings.polled));
  return std::vector<std::string>();
}

// The usual baud rate of a model, when the options give none.
std::int64_t usual_baud(Form form) {
  if (form == Form::kFiveWireless) return 9600;
  return form == Form::kUltraWireless ? 115200 : 19200;
}

// Bits of the product id: bit 0 is a left hand, 1 and 2 a wireless kit and its port B, 4 five
// sensors.
std::vector<std::uint16_t> products(const Settings& settings) {
  const int base =
      (settings.hand == Side::kLeft ? 0x01 : 0) | (settings.form == Form::kUltraUsb5 ? 0x10 : 0);
  const auto product = [base](int bits) { return static_cast<std::uint16_t>(base | bits); };
  return {product(0), product(0x02), product(0x06)};
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options = glove::serial_options(0);
  options.back().help = "bits a second of the serial port; 0: what the model uses as a rule";
  options.push_back({.name = "model",
                     .default_value = std::string("5"),
                     .help = "5, 5-wireless, 16, ultra-wireless, ultra-usb-5 or ultra-usb-14",
                     .words = kFormNames});
  options.push_back({.name = "poll_hz",
                     .default_value = std::int64_t{0},
                     .help = "model 5 is asked so often a second; 0: it streams",
                     .min = 0,
                     .max = kMaxPoll_hz});
  options.push_back({.name = "kit_port",
                     .default_value = std::string("a"),
                     .help = "a or b: which glove of an Ultra Wireless kit",
                     .words = kKitPorts});
  return options;
}

struct FiveDt : glove::GloveType<FiveDt> {
  using Settings = fivedt::Settings;
  static constexpr std::string_view kName = "fivedt";
  static constexpr std::string_view kSummary =
      "5DT data gloves: serial, Ultra Wireless and Ultra USB";
  static constexpr std::span<const KnownUsb> kUsb = kUltraUsb;
  static constexpr auto option_specs = all_options;

  static Result<Settings> settings(Options& options) {
    const auto hand = TRY(glove::hand_option(options));
    const auto form = static_cast<Form>(choice_option(options, "model", kFormNames));
    const bool polled = option<std::int64_t>(options, "poll_hz") > 0;
    if (polled && form != Form::kFive) {
      return misuse("poll_hz should be 0 (stream): only model = \"5\" can be polled");
    }
    if (option<std::int64_t>(options, "baud") == 0) options["baud"] = usual_baud(form);
    return Settings{.hand = hand,
                    .form = form,
                    .polled = polled,
                    .port_b = choice_option(options, "kit_port", kKitPorts) == 1};
  }
  static Result<std::string> check(const Options& options, const Settings& settings) {
    if (is_usb(settings.form)) return option<std::string>(options, "id");
    return GloveType::check(options, settings);
  }
  static std::string device_info(const Settings& settings) {
    return glove::hand_info(kName, settings.hand) +
           " model=" + std::string(kFormNames[static_cast<std::size_t>(settings.form)]) +
           " mode=" + std::string(kModes[settings.polled ? 1 : 0]) +
           " kit_port=" + std::string(kKitPorts[settings.port_b ? 1 : 0]);
  }
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    glove::DeviceInfoReader reader(text, kName, identity);
    Settings settings{.hand = reader.side()};
    settings.form = static_cast<Form>(reader.choice("model", kFormNames));
    settings.polled = reader.choice("mode", kModes) == 1;
    settings.port_b = reader.choice("kit_port", kKitPorts) == 1;
    TRY(reader.finish());
    return settings;
  }
  static Result<glove::Model> model(const Settings& settings) {
    return fivedt::model(settings.form);
  }
  static SampleLayout layout(const glove::Model& model, const Settings& settings) {
    return fivedt::layout(model, settings.form);
  }
  static std::unique_ptr<Decoder> make_decoder(
      const Settings& settings, std::shared_ptr<const Skeleton> skeleton,
      std::shared_ptr<const glove::Calibration> calibration) {
    return std::make_unique<FiveDtDecoder>(std::move(skeleton), std::move(calibration), settings);
  }
  static Result<Opened> open(const Options& options, const Settings& settings,
                             TransportFactory& ports) {
    const bool usb = is_usb(settings.form);
    auto link = TRY(usb ? ports.hid({.vendor = kUltraUsb[0].vendor,
                                     .products = products(settings),
                                     .id = option<std::string>(options, "id"),
                                     .path = option<std::string>(options, "port")})
                        : glove::connect(options, ports, std::vector<std::uint32_t>()));
    auto warnings = TRY(start(link, settings));
    Opened opened{.identity = link.identity(),
                  .transport = usb ? make_hid_transport(std::move(link))
                                   : make_link_transport(std::move(link)),
                  .warnings = std::move(warnings),
                  .reopen_after_s = kSilence_s};
    if (settings.polled) {
      opened.poll = {.request = {std::byte{'C'}},
                     .period_ns = kNanosPerSecond / option<std::int64_t>(options, "poll_hz")};
    }
    return opened;
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<FiveDtEmulator>(settings);
  }
};

}  // namespace
}  // namespace fivedt

const Driver& fivedt_driver() { return DriverOf<fivedt::FiveDt>::get(); }

}  // namespace posed::drivers
