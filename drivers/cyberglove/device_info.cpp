#include "drivers/cyberglove/device_info.hpp"

#include <bit>

#include "drivers/glove/device_info.hpp"

namespace posed::drivers::cyberglove {
namespace {

// Longer than the period of any rate that the options allow.
constexpr int kMaxTicks = 65535 * 1024;

}  // namespace

std::string device_info_of(const GloveSettings& glove) {
  const Layout& layout = glove.layout;
  return "cyberglove hand=" + std::string(glove::side_name(glove.hand)) +
         " sensors=" + std::to_string(std::popcount(layout.mask)) +
         " mask=" + std::to_string(layout.mask) +
         " form=" + std::string(kForms[static_cast<std::size_t>(layout.form)]) +
         " mode=" + std::string(kModes[static_cast<std::size_t>(layout.mode)]) +
         " time=" + (layout.time ? "1" : "0") + " status=" + (layout.status ? "1" : "0") +
         " ticks=" + std::to_string(glove.ticks) +
         " multiplier=" + std::to_string(layout.multiplier);
}

Result<GloveSettings> read_device_info(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, "cyberglove", identity);
  GloveSettings glove;
  glove.hand = reader.side();
  const int sensors = reader.whole("sensors", 1, static_cast<int>(kSensors));
  glove.layout.mask =
      static_cast<std::uint32_t>(reader.whole("mask", 1, static_cast<int>(kAllSensors)));
  glove.layout.form = static_cast<Form>(reader.choice("form", kForms));
  glove.layout.mode = static_cast<Mode>(reader.choice("mode", kModes));
  glove.layout.time = reader.whole("time", 0, 1) == 1;
  glove.layout.status = reader.whole("status", 0, 1) == 1;
  glove.ticks = reader.whole("ticks", 0, kMaxTicks);
  glove.layout.multiplier = reader.whole("multiplier", 1, kMaxMultiplier);
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  if (std::popcount(glove.layout.mask) != sensors) {
    return fail(
        "the device info of a 'cyberglove' and its mask have different numbers of sensors; the log "
        "is damaged",
        identity);
  }
  return glove;
}

}  // namespace posed::drivers::cyberglove
