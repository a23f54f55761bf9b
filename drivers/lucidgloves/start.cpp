#include "drivers/lucidgloves/start.hpp"

#include <chrono>
#include <string>

namespace posed::drivers::lucidgloves {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPatience{3000};  // for a line: an ESP32 starts in about a second
// For the answer to the info request; most firmware sends none.
constexpr milliseconds kInfoPatience{150};
constexpr milliseconds kOneRead{50};
constexpr std::string_view kAsk = "(ZA)Z\n";  // start the stream, and send your info

// What has been received from a glove so far.
struct Seen {
  std::string text;  // the unfinished line
  bool any = false;
  bool hand = false;
  bool too_large = false;  // a line with a value above the range
  int is_right = -1;
};

void take_line(const Settings& settings, Seen& seen) {
  while (!seen.text.empty() && seen.text.back() == '\r') seen.text.pop_back();
  Line line;
  const Outcome outcome = parse_line(seen.text, settings.encoding, settings.max_analog, line);
  seen.too_large = seen.too_large || outcome == Outcome::kOutOfRange;
  if (outcome != Outcome::kOk) return;
  seen.hand = seen.hand || line.has_hand();
  if (line.has_info[2]) seen.is_right = line.info[2];
}

void take(std::span<const std::byte> bytes, const Settings& settings, Seen& seen) {
  seen.any = seen.any || !bytes.empty();
  for (const std::byte byte : bytes) {
    const char c = static_cast<char>(byte);
    if (c == '\n') {
      take_line(settings, seen);
      seen.text.clear();
    } else if (seen.text.size() <= kMaxLine) {
      seen.text += c;
    }
  }
}

std::unexpected<Error> no_glove(const Connection& link, const Settings& settings,
                                const Seen& seen) {
  if (!seen.any) {
    return fail("the glove sends nothing; check that it is switched on, and its baud", link.name());
  }
  if (seen.too_large) {
    return fail("the glove sends values above max_analog_value = " +
                    std::to_string(settings.max_analog) + "; set it to 4095 for an ESP32",
                link.name());
  }
  return fail("what comes is no line of a LucidGlove; check baud, encoding and port", link.name());
}

}  // namespace

Result<> start(Connection& link, Side side, const Settings& settings) {
  if (auto ok = link.write(kAsk); !ok) return ok;
  Seen seen;
  const auto begin = Clock::now();
  auto good = begin;  // when the first good line came
  for (;;) {
    const auto now = Clock::now();
    if (!seen.hand) good = now;
    const bool told = seen.is_right >= 0 || now - good > kInfoPatience;
    if (seen.hand && told && (seen.text.empty() || now - good > 2 * kInfoPatience)) break;
    if (now - begin > kPatience) return no_glove(link, settings, seen);
    const auto bytes = link.read(kOneRead);
    if (!bytes) return std::unexpected(bytes.error());
    take(*bytes, settings, seen);
  }
  const int wanted = side == Side::kRight ? 1 : 0;
  if (seen.is_right >= 0 && seen.is_right != wanted) {
    const std::string hand = wanted == 1 ? "left" : "right";
    return fail("this is a " + hand + " glove; set hand = \"" + hand + "\" or take the other one",
                link.name());
  }
  return {};
}

}  // namespace posed::drivers::lucidgloves
