// The described driver: any glove that a TOML file describes.
#include <algorithm>
#include <chrono>

#include "drivers/described/decoder.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/described/emulator.hpp"
#include "drivers/described/protocol.hpp"
#include "drivers/glove/glove_type.hpp"
#include "drivers/transport/transport_factory.hpp"

namespace posed::drivers {
namespace described {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kQuiet{50};
constexpr milliseconds kFirstPacket{2000};
constexpr double kSilence_s = 1.0;  // at least this, or this many periods of a slow device:
constexpr double kSilentPeriods = 5.0;

// The hand, and a device description as in its file with what it says.
struct DescribedSettings {
  Side hand = Side::kRight;
  std::string toml;
  Table table;
};

bool has_packet(const Table& table, std::span<const std::byte> bytes) {
  for (; !bytes.empty(); bytes = bytes.subspan(1)) {
    if (look_for_packet(table, bytes).found == Look::Found::kPacket) {
      return true;
    }
  }
  return false;
}

// Stops the device's stream, starts it, and waits for the first packet that fits the description.
// With a wrong baud rate or another device on the port, none does.
Result<> start(const Table& table, Connection& link) {
  if (!table.link.stop.empty()) {
    TRY(link.write(table.link.stop));
    TRY(link.drain(kQuiet));
  }
  if (!table.link.start.empty()) {
    TRY(link.write(table.link.start));
  }
  std::vector<std::byte> received;
  const auto until = std::chrono::steady_clock::now() + kFirstPacket;
  while (std::chrono::steady_clock::now() < until && received.size() < 8 * kMaxPacketBytes) {
    const auto bytes = TRY(link.read(kQuiet));
    received.insert(received.end(), bytes.begin(), bytes.end());
    if (!bytes.empty() && has_packet(table, received)) return {};
  }
  if (received.empty()) {
    return fail("nothing came within 2 seconds; is it the " + table.name + ", and switched on?",
                link.name());
  }
  return fail(std::to_string(received.size()) + " bytes came, but no packet of a " + table.name +
                  "; is another device on this port, or is baud wrong?",
              link.name());
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options{
      {.name = "device",
       .default_value = std::string(),
       .required = true,
       .is_path = true,
       .help = "what it is: vmg30, opencyberglove, bebop_forte, or a description's path (.toml)",
       .path_ending = kDeviceEnding}};
  for (OptionSpec& spec : glove::serial_options(0)) options.push_back(std::move(spec));
  options.push_back({.name = "listen",
                     .default_value = std::string(),
                     .help = "address and port that a glove with kind = tcp connects to"});
  options.push_back({.name = "peers",
                     .default_value = std::string(),
                     .help = "addresses that may connect, separated by blanks"});
  return options;
}

struct DescribedGlove : glove::GloveType<DescribedGlove> {
  using Settings = DescribedSettings;
  static constexpr std::string_view kName = "described";
  static constexpr std::string_view kSummary =
      "any device that a TOML file describes: VMG30, OpenCyberGlove, BeBop Forte, yours";
  static constexpr auto option_specs = all_options;

  // What the options leave out is as the description says. An error names its file.
  static Result<Settings> settings(Options& options) {
    const auto hand = TRY(glove::hand_option(options));
    const auto device = option<std::string>(options, "device");
    auto toml = TRY(device_text(device));
    auto table = TRY(parse_device(toml, device));
    const LinkRule& link = table.link;
    if (option<std::int64_t>(options, "baud") == 0) options["baud"] = std::int64_t{link.baud};
    if (option<std::string>(options, "listen").empty()) options["listen"] = link.listen;
    options["link"] = std::string(link.kind == LinkKind::kTcp ? "tcp" : "serial");
    return Settings{.hand = hand, .toml = std::move(toml), .table = std::move(table)};
  }
  static Result<std::string> check(const Options& options, const Settings& settings) {
    const auto id = settings.table.link.kind == LinkKind::kHid
                        ? Result<std::string>(option<std::string>(options, "id"))
                        : GloveType::check(options, settings);
    return id && id->empty() ? option<std::string>(options, "port") : id;
  }
  // One line of device info, then the description as in its file.
  static std::string device_info(const Settings& settings) {
    return glove::hand_info(kName, settings.hand) + "\n" + settings.toml;
  }
  static Result<Settings> parse_device_info(const std::string& text, const std::string& identity) {
    const std::size_t line_end = std::min(text.find('\n'), text.size());
    glove::DeviceInfoReader reader(text.substr(0, line_end), kName, identity);
    Settings settings{.hand = reader.side(), .toml = {}, .table = {}};
    TRY(reader.finish());
    if (line_end == text.size()) return fail("lacks the device's description", identity);
    settings.toml = text.substr(line_end + 1);
    auto table = TRY(parse_device(settings.toml, identity));
    settings.table = std::move(table);
    return settings;
  }
  static Result<glove::Model> model(const Settings& settings) { return settings.table.model; }
  static SampleLayout layout(const glove::Model& model, const Settings& settings) {
    SampleLayout layout = glove::sample_layout(model, settings.table.extra_names);
    std::ranges::copy_backward(settings.table.extra_units, layout.units.end());
    return layout;
  }
  static double rate_hz(const Settings& settings) { return settings.table.rate_hz; }
  static std::unique_ptr<Decoder> make_decoder(
      Settings settings, std::shared_ptr<const Skeleton> skeleton,
      std::shared_ptr<const glove::Calibration> calibration) {
    return std::make_unique<DescribedDecoder>(
        std::make_shared<const Table>(std::move(settings.table)), std::move(skeleton),
        std::move(calibration));
  }
  static Result<Opened> open(const Options& options, const Settings& settings,
                             TransportFactory& ports) {
    const LinkRule& rule = settings.table.link;
    const bool hid = rule.kind == LinkKind::kHid;
    const std::uint32_t usb_id = hid ? rule.usb_ids.front() : 0;
    auto link = TRY(hid ? ports.hid({.vendor = static_cast<std::uint16_t>(usb_id >> 16),
                                     .products = {static_cast<std::uint16_t>(usb_id & 0xFFFF)},
                                     .id = option<std::string>(options, "id"),
                                     .path = option<std::string>(options, "port")})
                        : glove::connect(options, ports, rule.usb_ids));
    TRY(start(settings.table, link));
    const double rate_hz = settings.table.rate_hz;
    Opened opened{.identity = link.identity(), .transport = nullptr};
    opened.transport =
        hid ? make_hid_transport(std::move(link)) : make_link_transport(std::move(link));
    opened.reopen_after_s =
        rate_hz > 0.0 ? std::max(kSilence_s, kSilentPeriods / rate_hz) : kSilence_s;
    return opened;
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/, Settings settings) {
    auto calibration = TRY(glove::default_calibration(settings.table.model));
    return std::make_unique<DescribedEmulator>(
        std::make_shared<const Table>(std::move(settings.table)), std::move(calibration));
  }
};

}  // namespace
}  // namespace described

const Driver& described_driver() { return DriverOf<described::DescribedGlove>::get(); }

}  // namespace posed::drivers
