#include "drivers/axis/axis.hpp"

#include <algorithm>

#include "drivers/axis/decoder.hpp"
#include "drivers/axis/emulator.hpp"
#include "drivers/axis/layout.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/network_options.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers {
namespace axis {
namespace {

constexpr std::string_view kName = "axis";
constexpr std::string_view kConnect = "127.0.0.1:7001";
constexpr std::string_view kListen = "127.0.0.1:7002";
constexpr std::array<std::string_view, 2> kLinks{"tcp", "udp"};
constexpr double kEmulatedRate_hz = 60.0;
constexpr double kMinRate_hz = 1.0;
constexpr double kMaxRate_hz = 1000.0;
constexpr std::int64_t kMaxSplit = 64 * 1024;

// 0: unknown.
bool is_rate(double rate_hz) {
  return rate_hz == 0.0 || (rate_hz >= kMinRate_hz && rate_hz <= kMaxRate_hz);
}

std::string device_info_of(const StreamSettings& settings) {
  return std::string(kName) + " link=" + std::string(kLinks[settings.datagrams ? 1 : 0]) +
         " order=" + std::string(kOrderNames[settings.order]) +
         " rate=" + clip::number_text(settings.rate_hz);
}

Result<StreamSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, kName, identity);
  StreamSettings settings;
  settings.datagrams = reader.choice("link", kLinks) == 1;
  settings.order = static_cast<std::uint8_t>(reader.choice("order", kOrderNames));
  const auto rate_hz = clip::parse_number(reader.word("rate"));
  if (const auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  if (!rate_hz || !is_rate(*rate_hz)) {
    return fail("the device info of 'axis' has a rate that cannot be; the log is damaged",
                identity);
  }
  settings.rate_hz = *rate_hz;
  return settings;
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto settings = read_device_info(text, identity);
  if (!settings) return std::unexpected(settings.error());
  return source_description(kName, text, identity, settings->rate_hz);
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  const auto settings = read_device_info(description.text, description.identity);
  if (!settings) return std::unexpected(settings.error());
  return std::make_unique<AxisDecoder>(*settings);
}

// The application serves on this machine unless the options say where it is. Over UDP it sends to
// `listen`, and so does an application that connects.
Result<Options> complete(const Options& given) {
  auto options = complete_options(axis_driver(), given);
  if (!options) return options;
  const bool waits = option<std::string>(*options, "link") != "tcp" ||
                     option<std::string>(*options, "listen") != kListen;
  if (waits && option<std::string>(*options, "connect") == kConnect) {
    (*options)["connect"] = std::string();  // the default; a config gives that, too
  }
  return options;
}

Result<EmulatorSettings> emulator_settings(const Options& options) {
  const auto form = std::ranges::find(kFormNames, option<std::string>(options, "format"));
  if (form == kFormNames.end()) {
    return misuse("format should be \"binary\", \"binary-1.0\" or \"text\"");
  }
  const auto order = std::ranges::find(kOrderNames, option<std::string>(options, "order"));
  if (order == kOrderNames.end()) {
    return misuse(
        "order should be the order of rotations that is set in the application: \"YXZ\", \"XYZ\", "
        "\"XZY\", \"YZX\", \"ZXY\" or \"ZYX\"");
  }
  const double rate_hz = option<double>(options, "rate_hz");
  if (!is_rate(rate_hz)) return misuse("rate_hz should be 1 to 1000, or 0 for unknown");
  const auto split = option<std::int64_t>(options, "split_bytes");
  if (split < 0 || split > kMaxSplit) return misuse("split_bytes should be 0 to 65536");
  return EmulatorSettings{.form = static_cast<Form>(form - kFormNames.begin()),
                          .content = {.displacement = option<bool>(options, "displacement"),
                                      .reference = option<bool>(options, "reference")},
                          .order = static_cast<std::uint8_t>(order - kOrderNames.begin()),
                          .rate_hz = rate_hz > 0.0 ? rate_hz : kEmulatedRate_hz,
                          .split_bytes = static_cast<std::size_t>(split)};
}

Result<Description> expect(const Options& given) {
  const auto options = complete(given);
  if (!options) return std::unexpected(options.error());
  const auto settings = emulator_settings(*options);
  if (!settings) return std::unexpected(settings.error());
  if (const auto ok = check_network(*options); !ok) return std::unexpected(ok.error());
  return describe(device_info_of({.order = settings->order,
                                  .datagrams = option<std::string>(*options, "link") == "udp",
                                  .rate_hz = option<double>(*options, "rate_hz")}),
                  network_identity(*options));
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto expected = expect(given);
  if (!expected) return std::unexpected(expected.error());
  const auto options = complete(given);
  auto transport = open_network(*options, ports);
  if (!transport) return std::unexpected(transport.error());
  return make_device(axis_driver(), *expected, std::move(*transport));
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  const auto options = complete(given);
  if (!options) return std::unexpected(options.error());
  const auto settings = emulator_settings(*options);
  if (!settings) return std::unexpected(settings.error());
  return std::make_unique<AxisEmulator>(*settings);
}

std::vector<OptionSpec> all_options() {
  auto specs = network_options("tcp", kListen);
  std::ranges::find(specs, "connect", &OptionSpec::name)->default_value = std::string(kConnect);
  specs.push_back({.name = "order",
                   .default_value = std::string(kOrderNames[0]),
                   .help = "order of rotations that is set in the application"});
  specs.push_back({.name = "rate_hz",
                   .default_value = 0.0,
                   .help = "frames a second that the application sends, so that its frame numbers "
                           "are a clock; 0: unknown, the arrival counts"});
  specs.push_back({.name = "format",
                   .default_value = std::string(kFormNames[0]),
                   .help = "for the emulator: binary, binary-1.0 or text; posed sees it itself"});
  specs.push_back({.name = "displacement",
                   .default_value = true,
                   .help = "for the emulator: every bone has a position"});
  specs.push_back({.name = "reference",
                   .default_value = false,
                   .help = "for the emulator: the values begin with a bone above the hips"});
  specs.push_back({.name = "split_bytes",
                   .default_value = std::int64_t{0},
                   .help = "for the emulator over UDP: the most bytes of a datagram, each with one "
                           "message or a piece of it; 0: a frame of all avatars at once"});
  return specs;
}

}  // namespace
}  // namespace axis

const Driver& axis_driver() {
  static const Driver driver{
      .name = axis::kName,
      .summary =
          "Axis Neuron and Axis Studio (Perception Neuron): their BVH streams over TCP or "
          "UDP",
      .options = axis::all_options(),
      .open = axis::open,
      .make_decoder = axis::make_decoder,
      .describe = axis::describe,
      .expect = axis::expect,
      .make_layout = axis::make_layout,
      .emulate = axis::emulate};
  return driver;
}

}  // namespace posed::drivers
