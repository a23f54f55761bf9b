// The bend5 driver: a glove of five bend sensors that writes their values as text over a serial
// port (115200 baud), separated by commas, about 50 times a second:
//
//   512,600,12,0,1023
//
// Each value, thumb to little finger, is 0 (straight) to 1023 (closed). A line has no checksum.
#include <charconv>

#include "drivers/glove/text_glove.hpp"

namespace posed::drivers {
namespace bend5 {
namespace {

// A CH340, the USB-serial chip of its board: other devices have it, too.
constexpr std::array<KnownUsb, 1> kCh340{
    KnownUsb{.vendor = 0x1A86, .product = 0x7523, .adapter = true}};

struct Bend5 : glove::TextGlove<Bend5> {
  using Reading = glove::TextReading<Bend5>;
  static constexpr std::string_view kName = "bend5";
  static constexpr std::string_view kSummary = "a glove of five bend sensors that writes text";
  static constexpr std::span<const KnownUsb> kUsb = kCh340;
  static constexpr std::int64_t kBaud = 115200;
  static constexpr double kRate_hz = 50.0;
  static constexpr double kRawMax = 1023.0;
  static constexpr std::array<std::string_view, 5> kSensors = kFingerNames;
  static constexpr std::array<std::string_view, 0> kExtras{};
  static constexpr double kUndetected = 0.9;  // other digits are a line, too

  // kForeign for what is no such line, kOutOfRange for a value above 1023.
  RT_SAFE static Outcome parse(std::string_view text, Reading& reading) noexcept {
    const char* at = text.data();
    const char* const end = text.data() + text.size();
    for (std::size_t s = 0; s < kSensors.size(); ++s) {
      if (s > 0 && (at == end || *at++ != ',')) return Outcome::kForeign;
      unsigned bend = 0;
      const auto [stop, error] = std::from_chars(at, end, bend);
      if (error != std::errc()) return Outcome::kForeign;
      if (bend > kRawMax) return Outcome::kOutOfRange;
      reading.raw[s] = static_cast<float>(bend);
      reading.valid[s] = true;
      at = stop;
    }
    return at == end ? Outcome::kOk : Outcome::kForeign;
  }

  static std::string write(const Reading& reading) {
    std::string line;
    for (const float bend : reading.raw) {
      line += (line.empty() ? "" : ",") + std::to_string(static_cast<int>(bend));
    }
    return line + '\n';
  }
};

}  // namespace
}  // namespace bend5

const Driver& bend5_driver() { return DriverOf<bend5::Bend5>::get(); }

}  // namespace posed::drivers
