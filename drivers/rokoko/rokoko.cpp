// The rokoko driver: people, gloves, faces and props from Rokoko Studio, over UDP.
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "drivers/source_type.hpp"

namespace posed::drivers {
namespace rokoko {
namespace {

constexpr std::array<std::string_view, 3> kVersions{"2", "2.5", "3"};  // as StudioVersion

struct Rokoko : RateSource<Rokoko> {
  using DecoderType = StudioDecoder;
  static constexpr std::string_view kName = "rokoko";
  static constexpr std::string_view kSummary =
      "Rokoko Studio's live stream over UDP: suits, gloves, faces, props (JSON 2 and 3, plain or "
      "LZ4)";
  static constexpr std::string_view kWhat = "Rokoko Studio";
  static constexpr std::string_view kListen = "127.0.0.1:14043";
  static constexpr double kRate_hz = 60.0;
  static constexpr std::string_view kRateHelp = "frames a second that Studio is set to stream";
  static constexpr auto make_layout = rokoko::make_layout;

  static std::vector<OptionSpec> more_options() {
    return {{.name = "version",
             .default_value = std::string("3"),
             .help = "only for posed emulate: the JSON that it sends, 2, 2.5 or 3",
             .words = kVersions},
            {.name = "lz4",
             .default_value = true,
             .help = "only for posed emulate: whether it compresses"}};
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& options,
                                                    const Settings& settings) {
    return std::make_unique<StudioEmulator>(StudioEmulatorSettings{
        .rate_hz = settings.rate_hz,
        .version = static_cast<StudioVersion>(choice_option(options, "version", kVersions)),
        .lz4 = option<bool>(options, "lz4")});
  }
};

}  // namespace
}  // namespace rokoko

const Driver& rokoko_driver() { return DriverOf<rokoko::Rokoko>::get(); }

}  // namespace posed::drivers
