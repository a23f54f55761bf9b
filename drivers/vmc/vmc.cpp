// The vmc driver: an avatar's bones, blend shapes and trackers from any VMC performer, over UDP.
#include "drivers/source_type.hpp"
#include "drivers/vmc/decoder.hpp"
#include "drivers/vmc/emulator.hpp"

namespace posed::drivers {
namespace vmc {
namespace {

constexpr std::array<std::string_view, 3> kPackings{"bundle", "bundles", "messages"};  // as Packing

struct Vmc : RateSource<Vmc> {
  using DecoderType = VmcDecoder;
  static constexpr std::string_view kName = "vmc";
  static constexpr std::string_view kSummary =
      "a VMC performer: an avatar's bones, blend shapes and trackers as OSC over UDP (Virtual "
      "Motion Capture, VSeeFace, SlimeVR and others)";
  static constexpr std::string_view kWhat = "a VMC performer";
  static constexpr std::string_view kListen = "127.0.0.1:39539";
  static constexpr double kRate_hz = 60.0;
  static constexpr std::string_view kRateHelp = "frames a second that the performer is set to";
  static constexpr auto make_layout = vmc::make_layout;

  static std::vector<OptionSpec> more_options() {
    return {{.name = "packing",
             .default_value = std::string("bundle"),
             .help = "of the emulator: a frame as one 'bundle', as 'bundles' of at most 1,472 "
                     "bytes, or as single 'messages'; posed reads them all",
             .words = kPackings}};
  }
  static Result<std::unique_ptr<Emulator>> emulator(const Options& options,
                                                    const Settings& settings) {
    const auto packing = static_cast<Packing>(choice_option(options, "packing", kPackings));
    return std::make_unique<VmcEmulator>(settings.rate_hz, packing);
  }
};

}  // namespace
}  // namespace vmc

const Driver& vmc_driver() { return DriverOf<vmc::Vmc>::get(); }

}  // namespace posed::drivers
