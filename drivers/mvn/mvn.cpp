// The mvn driver: people in Xsens suits from MVN's Network Streamer, over UDP or TCP.
#include <algorithm>

#include "drivers/mvn/decoder.hpp"
#include "drivers/mvn/emulator.hpp"
#include "drivers/mvn/layout.hpp"
#include "drivers/source_type.hpp"
#include "proto/text/number.hpp"

namespace posed::drivers {
namespace mvn {
namespace {

constexpr double kDefaultRate_hz = 60.0;
constexpr std::int64_t kDefaultLongest = 1472;  // bytes: the usual 1500 of a network without heads

// The decoder needs `stream` and the rate, the emulator all but `stream`.
struct MvnSettings {
  bool stream = false;  // over TCP
  double rate_hz = kDefaultRate_hz;
  MvnEmulator::Settings emulated{};
};

std::string link_prefix(bool stream) {
  return std::string("mvn link=") + (stream ? "tcp" : "udp") + " rate=";
}

Result<std::vector<Type>> types_of(const Options& options) {
  std::vector<Type> types;
  for (const std::string& word : words_option(options, "types")) {
    const int number = exact_number<int>(word).value_or(0);
    const bool known = number == 1 || number == 2 || number == 5 || number == 12 || number == 13 ||
                       (number >= 20 && number <= 25);
    if (!known) {
      return misuse("types should be a list of 01, 02, 05, 12, 13 and 20 to 25");
    }
    types.push_back(static_cast<Type>(number));
  }
  if (std::ranges::none_of(types, is_pose)) {
    return misuse("types should have 01, 02 or 05, because only these hold poses");
  }
  return types;
}

std::vector<OptionSpec> options() {
  auto specs = network_options("udp", "127.0.0.1:9763");
  specs.push_back(
      rate_option(kDefaultRate_hz, "samples a second that the Network Streamer is set to"));
  specs.push_back({.name = "types",
                   .default_value = std::string("02 12 13"),
                   .help = "of the emulator: the types of datagrams that it sends"});
  specs.push_back({.name = "characters",
                   .default_value = std::int64_t{2},
                   .help = "of the emulator: 1 or 2",
                   .min = 1,
                   .max = 2});
  specs.push_back({.name = "datagram_bytes",
                   .default_value = kDefaultLongest,
                   .help = "of the emulator: longer samples are split",
                   .min = 100,
                   .max = 65'000});
  return specs;
}

struct Mvn : NetworkRateSource<Mvn> {
  using Settings = MvnSettings;
  static constexpr std::string_view kName = "mvn";
  static constexpr std::string_view kSummary =
      "Xsens MVN (Movella): people in suits, with or without gloves, over UDP or TCP";
  static constexpr auto option_specs = mvn::options;
  static constexpr std::string_view kWhat = "Xsens MVN";
  static constexpr std::string_view kExample = "mvn link=udp rate=60";
  using DecoderType = MvnDecoder;
  static constexpr auto link_prefix = mvn::link_prefix;
  static constexpr auto make_layout = mvn::make_layout;

  static Result<Settings> settings(const Options& options) {
    auto types = TRY(types_of(options));
    const double rate_hz = option<double>(options, "rate_hz");
    return Settings{
        .stream = option<std::string>(options, "link") == "tcp",
        .rate_hz = rate_hz,
        .emulated = {
            .rate_hz = rate_hz,
            .types = std::move(types),
            .characters = static_cast<std::size_t>(option<std::int64_t>(options, "characters")),
            .longest = static_cast<std::size_t>(option<std::int64_t>(options, "datagram_bytes"))}};
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/, Settings settings) {
    return std::make_unique<MvnEmulator>(std::move(settings.emulated));
  }
};

}  // namespace
}  // namespace mvn

const Driver& mvn_driver() { return DriverOf<mvn::Mvn>::get(); }

}  // namespace posed::drivers
