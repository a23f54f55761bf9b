// The axis driver: the BVH streams of Axis Neuron and Axis Studio (Perception Neuron), over TCP or
// UDP.
#include <algorithm>

#include "drivers/axis/decoder.hpp"
#include "drivers/axis/emulator.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/source_type.hpp"
#include "proto/clip/text.hpp"

namespace posed::drivers {
namespace axis {
namespace {

constexpr std::string_view kName = "axis";
constexpr std::string_view kConnect = "127.0.0.1:7001";
constexpr std::string_view kListen = "127.0.0.1:7002";
constexpr std::array<std::string_view, 2> kLinks{"tcp", "udp"};
constexpr std::array<std::string_view, 3> kFigures{"auto", kFigureNames[0], kFigureNames[1]};
constexpr double kEmulatedRate_hz = 60.0;
constexpr double kMinRate_hz = 1.0;
constexpr double kMaxSplit = 64 * 1024;

// 0: unknown.
bool is_rate(double rate_hz) {
  return rate_hz == 0.0 || (rate_hz >= kMinRate_hz && rate_hz <= kMaxRate_hz);
}

std::string device_info_of(const StreamSettings& settings) {
  return std::string(kName) + " link=" + std::string(kLinks[settings.datagrams ? 1 : 0]) +
         " order=" + std::string(kOrderNames[settings.order]) +
         " rate=" + clip::number_text(settings.rate_hz) +
         (settings.figure
              ? " figure=" + std::string(kFigureNames[static_cast<std::size_t>(*settings.figure)])
              : "");
}

// "auto" is none.
std::optional<Figure> figure_named(std::size_t index) {
  if (index == 0) return std::nullopt;
  return static_cast<Figure>(index - 1);
}

Result<StreamSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, kName, identity);
  StreamSettings settings;
  settings.datagrams = reader.choice("link", kLinks) == 1;
  settings.order = static_cast<std::uint8_t>(reader.choice("order", kOrderNames));
  const auto rate_hz = clip::parse_number(reader.word("rate"));
  if (text.contains(" figure="))
    settings.figure = figure_named(1 + reader.choice("figure", kFigureNames));
  TRY(reader.finish());
  if (!rate_hz || !is_rate(*rate_hz)) {
    return fail("the device info of 'axis' has a rate that cannot be; the log is damaged",
                identity);
  }
  settings.rate_hz = *rate_hz;
  return settings;
}

// The application serves on this machine unless the options say where it is. Over UDP it sends to
// `listen`, and so does an application that connects.
void drop_default_connect(Options& options) {
  const bool waits = option<std::string>(options, "link") != "tcp" ||
                     option<std::string>(options, "listen") != kListen;
  if (waits && option<std::string>(options, "connect") == kConnect) {
    options["connect"] = std::string();  // a config also gives the default
  }
}

std::vector<OptionSpec> all_options() {
  auto specs = network_options("tcp", kListen);
  std::ranges::find(specs, "connect", &OptionSpec::name)->default_value = std::string(kConnect);
  specs.push_back({.name = "order",
                   .default_value = std::string(kOrderNames[0]),
                   .help = "order of rotations that is set in the application",
                   .words = kOrderNames});
  specs.push_back({.name = "figure",
                   .default_value = std::string(kFigures[0]),
                   .help = "whose bones the stream has: pro of Axis Neuron, studio of Axis Studio; "
                           "auto: by their lengths",
                   .words = kFigures});
  specs.push_back({.name = "rate_hz",
                   .default_value = 0.0,
                   .help = "frames a second that the application sends, so that its frame numbers "
                           "are a clock; 0: unknown, the arrival counts"});
  specs.push_back({.name = "format",
                   .default_value = std::string(kFormNames[0]),
                   .help = "for the emulator: binary, binary-1.0 or text; posed sees it itself",
                   .words = kFormNames});
  specs.push_back({.name = "displacement",
                   .default_value = true,
                   .help = "for the emulator: every bone has a position"});
  specs.push_back({.name = "reference",
                   .default_value = false,
                   .help = "for the emulator: the values begin with a bone above the hips"});
  specs.push_back({.name = "split_bytes",
                   .default_value = std::int64_t{0},
                   .help = "for the emulator over UDP: the most bytes of a datagram, each with one "
                           "message or a piece of it; 0: a frame of all avatars at once",
                   .min = 0,
                   .max = kMaxSplit});
  return specs;
}

struct AxisSource : SourceType<AxisSource> {
  using Settings = StreamSettings;
  static constexpr std::string_view kName = axis::kName;
  static constexpr std::string_view kSummary =
      "Axis Neuron and Axis Studio (Perception Neuron): their BVH streams over TCP or UDP";
  static constexpr auto option_specs = axis::all_options;
  static constexpr auto device_info = axis::device_info_of;
  static constexpr auto parse_device_info = axis::read_device_info;
  static constexpr auto make_layout = axis::make_layout;
  static constexpr auto connect = open_network;

  static Result<Settings> settings(Options& options) {
    drop_default_connect(options);
    const double rate_hz = option<double>(options, "rate_hz");
    if (!is_rate(rate_hz)) return misuse("rate_hz should be 1 to 1000, or 0 for unknown");
    return Settings{
        .order = static_cast<std::uint8_t>(choice_option(options, "order", kOrderNames)),
        .datagrams = option<std::string>(options, "link") == "udp",
        .rate_hz = rate_hz,
        .figure = figure_named(choice_option(options, "figure", kFigures))};
  }
  static Result<std::string> check(const Options& options, const Settings& /*settings*/) {
    TRY(check_network(options));
    return network_identity(options);
  }
  static Result<std::unique_ptr<Decoder>> decoder(const Settings& settings,
                                                  const Description& /*description*/) {
    return std::make_unique<AxisDecoder>(settings);
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& options,
                                                    const Settings& settings) {
    return std::make_unique<AxisEmulator>(EmulatorSettings{
        .form = static_cast<Form>(choice_option(options, "format", kFormNames)),
        .content = {.displacement = option<bool>(options, "displacement"),
                    .reference = option<bool>(options, "reference")},
        .order = settings.order,
        .rate_hz = settings.rate_hz > 0.0 ? settings.rate_hz : kEmulatedRate_hz,
        .split_bytes = static_cast<std::size_t>(option<std::int64_t>(options, "split_bytes")),
        .figure = settings.figure});
  }
};

}  // namespace
}  // namespace axis

const Driver& axis_driver() { return DriverOf<axis::AxisSource>::get(); }

}  // namespace posed::drivers
