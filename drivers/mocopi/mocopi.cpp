// The mocopi driver: Sony mocopi, whose phone app streams one person over UDP.
#include "drivers/mocopi/decoder.hpp"
#include "drivers/mocopi/emulator.hpp"
#include "drivers/source_type.hpp"

namespace posed::drivers {
namespace mocopi {
namespace {

struct Mocopi : RateSource<Mocopi> {
  using DecoderType = MocopiDecoder;
  static constexpr std::string_view kName = "mocopi";
  static constexpr std::string_view kSummary =
      "Sony mocopi: the phone app's motion stream over UDP (unofficial description)";
  static constexpr std::string_view kWhat = "a mocopi";
  static constexpr std::string_view kListen = "127.0.0.1:12351";
  static constexpr double kRate_hz = 60.0;
  static constexpr std::string_view kRateHelp = "frames a second that the app is set to, 50 or 60";
  static constexpr auto make_layout = mocopi::make_layout;

  static Result<std::unique_ptr<Emulator>> emulator(const Options& /*options*/,
                                                    const Settings& settings) {
    return std::make_unique<MocopiEmulator>(settings.rate_hz);
  }
};

}  // namespace
}  // namespace mocopi

const Driver& mocopi_driver() { return DriverOf<mocopi::Mocopi>::get(); }

}  // namespace posed::drivers
