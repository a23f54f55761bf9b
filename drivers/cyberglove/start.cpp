#include "drivers/cyberglove/start.hpp"

#include <algorithm>
#include <bit>

#include "drivers/cyberglove/talk.hpp"
#include "drivers/glove/greeting.hpp"

namespace posed::drivers::cyberglove {
namespace {

constexpr unsigned kInitialised = 1, kGloveIn = 2;  // bits of ?G

char byte_of(std::int64_t value) { return static_cast<char>(value & 0xFF); }

Result<> check_device(Talk& talk, const Wish& wish) {
  const auto info = talk.info();
  if (!info) return std::unexpected(info.error());
  if (info->contains("CyberGlove")) return {};
  const std::string rate = wish.over_tcp ? "" : " at " + std::to_string(wish.baud) + " baud";
  if (info->empty()) {
    return fail("nothing answers on " + talk.name() + rate +
                ": switch the CyberGlove's box on, and set baud as the box is set");
  }
  const auto printable = std::ranges::count_if(
      *info, [](char c) { return (c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == '\0'; });
  if (printable < static_cast<std::ptrdiff_t>(info->size() * 3 / 4)) {
    return fail(talk.name() + " answers what makes no sense" + rate +
                ": set baud as the CyberGlove's box is set (9600 to 115200), or name another port");
  }
  return fail(talk.name() + " is another device, not a CyberGlove: name the right port or id");
}

Result<> check_glove(Talk& talk) {
  const auto state = talk.query('G', 1);
  if (!state) return std::unexpected(state.error());
  if (((*state)[0] & kGloveIn) == 0) {
    return fail("the glove is not plugged into its box on " + talk.name() + ": plug it in");
  }
  if (((*state)[0] & kInitialised) != 0) return {};
  return talk.set("\x09", "\x09");  // the box reads the glove's data again
}

Result<> check_hand(Talk& talk, Side hand) {
  const auto right = talk.query('R', 1);
  if (!right) return std::unexpected(right.error());
  const Side worn = (*right)[0] == 0 ? Side::kLeft : Side::kRight;
  if (worn == hand) return {};
  const std::string name(glove::side_name(worn));
  return fail("the glove on " + talk.name() + " is a " + name + " one: set hand = \"" + name +
              "\", or plug the other glove in");
}

// The mask of the fitted sensors. Gloves of 18 and 22 are known; of others the box's own word is
// taken when it agrees with itself.
Result<std::uint32_t> read_mask(Talk& talk, int wanted) {
  const auto count = talk.query('S', 1);
  if (!count) return std::unexpected(count.error());
  const auto sensors = static_cast<int>((*count)[0]);
  const auto bytes = talk.query('K', 3);
  if (!bytes) return std::unexpected(bytes.error());
  const std::uint32_t mask = ((*bytes)[0] | (*bytes)[1] << 8 | (*bytes)[2] << 16) & kAllSensors;
  if (wanted != 0 && sensors != wanted) {
    return fail("the glove on " + talk.name() + " has " + std::to_string(sensors) +
                " sensors, not " + std::to_string(wanted) +
                ": set sensors, or use the other glove");
  }
  if (sensors == std::popcount(kMask18)) return kMask18;
  if (sensors == std::popcount(kMask22)) return kMask22;
  if (sensors > 0 && std::popcount(mask) == sensors) return mask;
  return fail("the box on " + talk.name() + " says it has " + std::to_string(sensors) +
              " sensors, and a mask of others: check the glove's plug");
}

Result<> set_and_read_back(Talk& talk, char letter, bool on) {
  if (auto ok = talk.set(std::string{letter, on ? '\x01' : '\0'}, {&letter, 1}); !ok) return ok;
  const auto value = talk.query(letter, 1);
  if (!value) return std::unexpected(value.error());
  if (((*value)[0] != 0) == on) return {};
  return fail(talk.name() + " does not keep the setting '" + std::string(1, letter) +
              "'; switch its box off and on again");
}

// Left over from the program before, these would change a sample's length without a word.
Result<> set_layout(Talk& talk, const Layout& layout) {
  const std::string mask{'M', byte_of(layout.mask), byte_of(layout.mask >> 8),
                         byte_of(layout.mask >> 16)};
  if (auto ok = talk.set(mask, "M"); !ok) return ok;
  if (auto ok = talk.set(std::string{'N', byte_of(std::popcount(layout.mask))}, "N"); !ok) {
    return ok;
  }
  if (auto ok = set_and_read_back(talk, 'U', layout.status); !ok) return ok;
  return set_and_read_back(talk, 'D', layout.time);
}

Result<> start_8bit(Talk& talk, const Wish& wish, const Layout& layout) {
  if (auto ok = set_layout(talk, layout); !ok) return ok;
  if (auto ok = talk.set(std::string{'F', wish.filter ? '\x01' : '\0'}, "F"); !ok) return ok;
  // In ASCII: sources differ on the byte order of the binary form.
  const std::string period =
      "t " + std::to_string(wish.period.w1) + " " + std::to_string(wish.period.w2) + "\r";
  if (auto ok = talk.set(period, "t"); !ok) return ok;
  switch (layout.mode) {
    case Mode::kStream:
      return talk.send("S");
    case Mode::kSync:
      return talk.set(std::string_view("Y\x01", 2), "Y");
    default:
      return {};
  }
}

Result<> start_16bit(Talk& talk, const Wish& wish, const Layout& layout) {
  const char link = wish.over_tcp ? 'w' : 'u';
  std::vector<std::string> commands{{'1', 'm', byte_of(layout.multiplier)}};
  if (!wish.over_tcp) commands.push_back("1dw");
  commands.push_back({'1', 'e', link});
  commands.push_back({'1', link, byte_of(wish.divider)});
  commands.push_back("1ds");
  for (const std::string& command : commands) {
    if (!talk.set(command, command)) {
      return fail("the glove on " + talk.name() +
                  " does not know 16-bit records: only a CyberGlove III does; set form = \"8bit\"");
    }
  }
  return layout.mode == Mode::kPoll ? Result<>{} : talk.send("1S");
}

}  // namespace

Result<Layout> start(Link& link, const Wish& wish) {
  Talk talk(link);
  if (auto ok = talk.stop(); !ok) return std::unexpected(ok.error());
  if (auto ok = check_device(talk, wish); !ok) return std::unexpected(ok.error());
  if (auto ok = check_glove(talk); !ok) return std::unexpected(ok.error());
  if (auto ok = check_hand(talk, wish.hand); !ok) return std::unexpected(ok.error());
  const auto mask = read_mask(talk, wish.sensors);
  if (!mask) return std::unexpected(mask.error());
  Layout layout = wish.layout;
  layout.mask = *mask;
  const auto started =
      layout.form == Form::k8Bit ? start_8bit(talk, wish, layout) : start_16bit(talk, wish, layout);
  if (!started) return std::unexpected(started.error());
  return layout;
}

}  // namespace posed::drivers::cyberglove
