#include "drivers/cyberglove/start.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/glove/device_info.hpp"
#include "drivers/transport/connection.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {
namespace {

// Session: commands and queries over a connection to a CyberGlove's box.
class Session {
 public:
  explicit Session(Connection& link) : link_(link) {}

  // Stops a running stream and discards the bytes still arriving.
  Result<> stop();
  // Returns the text about the device; empty when nothing came; otherwise the bytes received, even
  // if they are no such text.
  Result<std::string> info();
  // Returns the value bytes after "?L". They may be zero, so the answer is read by its length.
  Result<std::vector<unsigned>> query(char letter, std::size_t value_bytes);
  // Sends a setting and waits for its echo. Sources differ by a byte about the answer, so only the
  // letters are compared; then the line is drained.
  Result<> set(std::string_view command, std::string_view echo);
  Result<> send(std::string_view bytes) { return link_.write(bytes); }

  [[nodiscard]] const std::string& name() const { return link_.name(); }

 private:
  // Collects bytes until `done(text)` or until the wait is over; silence is not an error.
  template <typename Done>
  Result<std::string> listen(std::chrono::milliseconds patience, Done done);

  Connection& link_;
};

using std::chrono::milliseconds;

// A box at 1 Hz may still send; the check of the answers notices that.
constexpr milliseconds kQuiet{60};
constexpr milliseconds kAfterSet{20};  // time for bytes after the answer to a set command
constexpr milliseconds kInfo{2000};    // the text may take a second
constexpr milliseconds kAnswer{1000};
constexpr std::size_t kMaxText = 4096;  // limit for a device that streams and never ends its text

template <typename Done>
Result<std::string> Session::listen(milliseconds patience, Done done) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + patience;
  std::string received;
  while (!done(received) && received.size() < kMaxText) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) break;
    const auto bytes = TRY(link_.read(left));
    for (const std::byte byte : bytes) received.push_back(static_cast<char>(byte));
  }
  return received;
}

Result<> Session::stop() {
  TRY(link_.write(std::string_view("\x03")));
  return link_.drain(kQuiet);
}

Result<std::string> Session::info() {
  TRY(link_.write(std::string_view("?i")));
  return listen(kInfo, [](const std::string& received) {
    const std::size_t at = received.find("?i");
    return at != std::string::npos && received.find('\0', at) != std::string::npos;
  });
}

Result<std::vector<unsigned>> Session::query(char letter, std::size_t value_bytes) {
  const std::string question{'?', letter};
  TRY(link_.write(question));
  const std::size_t size = question.size() + value_bytes + 1;
  const auto received = TRY(listen(kAnswer, [&](const std::string& text) {
    const std::size_t at = text.find(question);
    return at != std::string::npos && text.size() >= at + size;
  }));
  const std::size_t at = received.find(question);
  if (at == std::string::npos || received.size() < at + size || received[at + size - 1] != '\0') {
    return fail(link_.name() + " did not answer '" + question +
                "' as a CyberGlove does; switch its box off and on again");
  }
  std::vector<unsigned> values(value_bytes);
  for (std::size_t i = 0; i < value_bytes; ++i) {
    values[i] = static_cast<unsigned char>(received[at + question.size() + i]);
  }
  return values;
}

Result<> Session::set(std::string_view command, std::string_view echo) {
  TRY(link_.write(command));
  const auto received = TRY(listen(kAnswer, [&](const std::string& text) {
    return text.size() > echo.size() && text.find('\0', echo.size()) != std::string::npos;
  }));
  if (!received.starts_with(echo)) {
    return fail(link_.name() + " does not accept the setting '" + std::string(1, command[0]) +
                "'; switch its box off and on again");
  }
  return link_.drain(kAfterSet);
}

constexpr unsigned kInitialised = 1, kGloveIn = 2;  // bits of ?G

char byte_of(std::int64_t value) { return static_cast<char>(value & 0xFF); }

Result<> check_device(Session& session, const RequestedConfig& requested) {
  const auto info = TRY(session.info());
  if (info.contains("CyberGlove")) return {};
  const std::string rate =
      requested.over_tcp ? "" : " at " + std::to_string(requested.baud) + " baud";
  if (info.empty()) {
    return fail("nothing answers on " + session.name() + rate +
                ": switch the CyberGlove's box on, and set baud as the box is set");
  }
  const auto printable = std::ranges::count_if(
      info, [](char c) { return (c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == '\0'; });
  if (printable < static_cast<std::ptrdiff_t>(info.size() * 3 / 4)) {
    return fail(session.name() + " sends answers that make no sense" + rate +
                ": set baud as the CyberGlove's box is set (9600 to 115200), or name another port");
  }
  return fail(session.name() + " is another device, not a CyberGlove: name the right port or id");
}

Result<> check_glove(Session& session) {
  const auto state = TRY(session.query('G', 1));
  if ((state[0] & kGloveIn) == 0) {
    return fail("the glove is not plugged into its box on " + session.name() + ": plug it in");
  }
  if ((state[0] & kInitialised) != 0) return {};
  return session.set("\x09", "\x09");  // the box reads the glove's data again
}

Result<> check_hand(Session& session, Side hand) {
  const auto right = TRY(session.query('R', 1));
  const Side worn = right[0] == 0 ? Side::kLeft : Side::kRight;
  if (worn == hand) return {};
  const std::string name(glove::side_name(worn));
  return fail("the glove on " + session.name() + " is a " + name + " one: set hand = \"" + name +
              "\", or plug the other glove in");
}

// Reads the mask of the fitted sensors. Gloves with 18 and 22 sensors are known; for others the
// box's mask is used if its sensor count agrees.
Result<std::uint32_t> read_mask(Session& session, int wanted) {
  const auto count = TRY(session.query('S', 1));
  const auto sensors = static_cast<int>(count[0]);
  const auto bytes = TRY(session.query('K', 3));
  const std::uint32_t mask = (bytes[0] | bytes[1] << 8 | bytes[2] << 16) & kAllSensors;
  if (wanted != 0 && sensors != wanted) {
    return fail("the glove on " + session.name() + " has " + std::to_string(sensors) +
                " sensors, not " + std::to_string(wanted) +
                ": set sensors, or use the other glove");
  }
  if (sensors == std::popcount(kMask18)) return kMask18;
  if (sensors == std::popcount(kMask22)) return kMask22;
  if (sensors > 0 && std::popcount(mask) == sensors) return mask;
  return fail("the box on " + session.name() + " reports " + std::to_string(sensors) +
              " sensors, but a mask with another number: check the glove's plug");
}

Result<> set_and_read_back(Session& session, char letter, bool on) {
  TRY(session.set(std::string{letter, on ? '\x01' : '\0'}, {&letter, 1}));
  const auto value = TRY(session.query(letter, 1));
  if ((value[0] != 0) == on) return {};
  return fail(session.name() + " does not keep the setting '" + std::string(1, letter) +
              "'; switch its box off and on again");
}

// These settings may be left over from another program and would silently change a sample's length.
Result<> set_layout(Session& session, const Layout& layout) {
  const std::string mask{'M', byte_of(layout.mask), byte_of(layout.mask >> 8),
                         byte_of(layout.mask >> 16)};
  TRY(session.set(mask, "M"));
  TRY(session.set(std::string{'N', byte_of(std::popcount(layout.mask))}, "N"));
  TRY(set_and_read_back(session, 'U', layout.status));
  return set_and_read_back(session, 'D', layout.time);
}

Result<> start_8bit(Session& session, const RequestedConfig& requested, const Layout& layout) {
  TRY(set_layout(session, layout));
  TRY(session.set(std::string{'F', requested.filter ? '\x01' : '\0'}, "F"));
  // Sent in ASCII, because sources differ on the byte order of the binary form.
  const std::string period =
      "t " + std::to_string(requested.period.w1) + " " + std::to_string(requested.period.w2) + "\r";
  TRY(session.set(period, "t"));
  switch (layout.mode) {
    case Mode::kStream:
      return session.send("S");
    case Mode::kSync:
      return session.set(std::string_view("Y\x01", 2), "Y");
    default:
      return {};
  }
}

Result<> start_16bit(Session& session, const RequestedConfig& requested, const Layout& layout) {
  const char link = requested.over_tcp ? 'w' : 'u';
  std::vector<std::string> commands{{'1', 'm', byte_of(layout.multiplier)}};
  if (!requested.over_tcp) commands.push_back("1dw");
  commands.push_back({'1', 'e', link});
  commands.push_back({'1', link, byte_of(requested.divider)});
  commands.push_back("1ds");
  for (const std::string& command : commands) {
    if (!session.set(command, command)) {
      return fail("the glove on " + session.name() +
                  " does not know 16-bit records: only a CyberGlove III does; set form = \"8bit\"");
    }
  }
  return layout.mode == Mode::kPoll ? Result<>{} : session.send("1S");
}

}  // namespace

Result<Layout> start(Connection& link, const RequestedConfig& requested) {
  Session session(link);
  TRY(session.stop());
  TRY(check_device(session, requested));
  TRY(check_glove(session));
  TRY(check_hand(session, requested.hand));
  const auto mask = TRY(read_mask(session, requested.sensors));
  Layout layout = requested.layout;
  layout.mask = mask;
  TRY(layout.form == Form::k8Bit ? start_8bit(session, requested, layout)
                                 : start_16bit(session, requested, layout));
  return layout;
}

}  // namespace posed::drivers::cyberglove
