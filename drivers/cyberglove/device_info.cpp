#include "drivers/cyberglove/device_info.hpp"

#include <bit>

#include "drivers/glove/device_info.hpp"

namespace posed::drivers::cyberglove {
namespace {

// Longer than the period of any rate that the options allow.
constexpr int kMostTicks = 65535 * 1024;

}  // namespace

std::string greeting_of(const Greeted& glove) {
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

Result<Greeted> read_greeting(const std::string& text, const std::string& identity) {
  glove::Greeting greeting(text, "cyberglove", identity);
  Greeted glove;
  glove.hand = greeting.side();
  const int sensors = greeting.whole("sensors", 1, static_cast<int>(kSensors));
  glove.layout.mask =
      static_cast<std::uint32_t>(greeting.whole("mask", 1, static_cast<int>(kAllSensors)));
  glove.layout.form = static_cast<Form>(greeting.choice("form", kForms));
  glove.layout.mode = static_cast<Mode>(greeting.choice("mode", kModes));
  glove.layout.time = greeting.whole("time", 0, 1) == 1;
  glove.layout.status = greeting.whole("status", 0, 1) == 1;
  glove.ticks = greeting.whole("ticks", 0, kMostTicks);
  glove.layout.multiplier = greeting.whole("multiplier", 1, kMaxMultiplier);
  if (auto ok = greeting.finish(); !ok) return std::unexpected(ok.error());
  if (std::popcount(glove.layout.mask) != sensors) {
    return fail(
        "the device info of a 'cyberglove' and its mask have different numbers of sensors; the log "
        "is damaged",
        identity);
  }
  return glove;
}

}  // namespace posed::drivers::cyberglove
