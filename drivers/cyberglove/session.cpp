#include "drivers/cyberglove/session.hpp"

namespace posed::drivers::cyberglove {
namespace {

using std::chrono::milliseconds;

// A box at 1 Hz may still send; the check of the answers notices that.
constexpr milliseconds kQuiet{60};
constexpr milliseconds kAfterSet{20};  // time for bytes after the answer to a set command
constexpr milliseconds kInfo{2000};    // the text may take a second
constexpr milliseconds kAnswer{1000};
constexpr std::size_t kMaxText = 4096;  // limit for a device that streams and never ends its text

}  // namespace

template <typename Done>
Result<std::string> Session::listen(milliseconds patience, Done done) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + patience;
  std::string received;
  while (!done(received) && received.size() < kMaxText) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) break;
    const auto bytes = link_.read(left);
    if (!bytes) return std::unexpected(bytes.error());
    for (const std::byte byte : *bytes) received.push_back(static_cast<char>(byte));
  }
  return received;
}

Result<> Session::stop() {
  if (auto ok = link_.write(std::string_view("\x03")); !ok) return ok;
  return link_.drain(kQuiet);
}

Result<std::string> Session::info() {
  if (auto ok = link_.write(std::string_view("?i")); !ok) return std::unexpected(ok.error());
  return listen(kInfo, [](const std::string& received) {
    const std::size_t at = received.find("?i");
    return at != std::string::npos && received.find('\0', at) != std::string::npos;
  });
}

Result<std::vector<unsigned>> Session::query(char letter, std::size_t value_bytes) {
  const std::string question{'?', letter};
  if (auto ok = link_.write(question); !ok) return std::unexpected(ok.error());
  const std::size_t size = question.size() + value_bytes + 1;
  const auto received = listen(kAnswer, [&](const std::string& text) {
    const std::size_t at = text.find(question);
    return at != std::string::npos && text.size() >= at + size;
  });
  if (!received) return std::unexpected(received.error());
  const std::size_t at = received->find(question);
  if (at == std::string::npos || received->size() < at + size ||
      (*received)[at + size - 1] != '\0') {
    return fail(link_.name() + " did not answer '" + question +
                "' as a CyberGlove does; switch its box off and on again");
  }
  std::vector<unsigned> values(value_bytes);
  for (std::size_t i = 0; i < value_bytes; ++i) {
    values[i] = static_cast<unsigned char>((*received)[at + question.size() + i]);
  }
  return values;
}

Result<> Session::set(std::string_view command, std::string_view echo) {
  if (auto ok = link_.write(command); !ok) return ok;
  const auto received = listen(kAnswer, [&](const std::string& text) {
    return text.size() > echo.size() && text.find('\0', echo.size()) != std::string::npos;
  });
  if (!received) return std::unexpected(received.error());
  if (!received->starts_with(echo)) {
    return fail(link_.name() + " does not accept the setting '" + std::string(1, command[0]) +
                "'; switch its box off and on again");
  }
  return link_.drain(kAfterSet);
}

}  // namespace posed::drivers::cyberglove
