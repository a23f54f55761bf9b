#include "drivers/lucidgloves/protocol.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>

namespace posed::drivers::lucidgloves {
namespace {

constexpr std::size_t kLegacyValues = 13;
constexpr std::size_t kLegacyButtons = 6;  // joystick to pinch
constexpr std::size_t kMaxKey = 8;         // characters within parentheses
constexpr std::size_t kMinMessage = 5;     // the firmware ignores shorter ones

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
bool is_key(char c) noexcept { return c >= 'A' && c <= 'Z'; }

// Removes a number from the front of `text` and returns it. Limited to far above every range; -1
// without a digit.
int next_number(std::string_view& text) noexcept {
  constexpr int kTop = 10'000'000;
  int value = 0;
  std::size_t digits = 0;
  for (; digits < text.size() && is_digit(text[digits]); ++digits) {
    if (value < kTop) value = value * 10 + (text[digits] - '0');
  }
  text.remove_prefix(digits);
  return digits == 0 ? -1 : value;
}

// Removes the key at the front of `text` and returns it without parentheses; empty when there is
// none.
std::string_view next_key(std::string_view& text) noexcept {
  std::string_view key;
  if (text.front() == '(') {
    std::size_t close = 1;
    while (close < text.size() && is_key(text[close])) ++close;
    if (close == text.size() || text[close] != ')' || close < 3 || close > kMaxKey) return {};
    key = text.substr(1, close - 1);
    text.remove_prefix(close + 1);
  } else if (is_key(text.front())) {
    key = text.substr(0, 1);
    text.remove_prefix(1);
  }
  return key;
}

bool is_finger(char c) noexcept { return c >= 'A' && c < 'A' + kFingers; }
std::size_t finger_of(char c) noexcept { return c - 'A'; }

// Index of the value that belongs to a key; empty when the key has no value.
std::optional<std::size_t> value_place(std::string_view key) noexcept {
  const char first = key.front();
  if (key.size() == 1) {
    if (is_finger(first)) return kCurl + finger_of(first);
    if (first == 'F') return kJoyX;
    if (first == 'G') return kJoyY;
    if (first == 'P') return kTrigger;
    return {};
  }
  if (!is_finger(first)) return {};
  if (key.size() == 2 && key[1] == 'B') return kSplay + finger_of(first);
  const bool joint = key.size() == 3 && key[1] == 'A' && key[2] >= 'A' && key[2] < 'A' + kJoints;
  if (!joint) return {};
  return kJoint + finger_of(first) * kJoints + finger_of(key[2]);
}

std::optional<std::size_t> button_place(std::string_view key) noexcept {
  const bool button = key.size() == 1 && key[0] >= 'H' && key[0] <= 'O';
  return button ? std::optional(static_cast<std::size_t>(key[0] - 'H')) : std::nullopt;
}

std::optional<std::size_t> info_place(std::string_view key) noexcept {
  if (key == "ZV") return 0;
  if (key == "ZG") return 1;
  if (key == "ZH") return 2;
  return {};
}

// Stores one key and its number (-1: none) in the line. Unknown keys are ignored.
Outcome store_pair(std::string_view key, int number, int max, Line& line) noexcept {
  if (const auto place = value_place(key)) {
    if (number < 0 || line.has[*place]) return Outcome::kForeign;
    // The firmware takes twice the upper half of the index finger for the trigger, which is a
    // little more than max where the finger is closed (AlphaEncoding.cpp).
    const bool over = *place == kTrigger && number <= 2 * max;
    if (number > max && !over) return Outcome::kOutOfRange;
    line.has[*place] = true;
    line.value[*place] = std::min(number, max);
  } else if (const auto button = button_place(key)) {
    if (line.pressed[*button]) return Outcome::kForeign;
    line.pressed[*button] = number != 0;
  } else if (const auto info = info_place(key)) {
    if (number < 0 || line.has_info[*info]) return Outcome::kForeign;
    line.has_info[*info] = true;
    line.info[*info] = number;
  }
  return Outcome::kOk;
}

Outcome parse_alpha(std::string_view text, int max, Line& line) noexcept {
  while (!text.empty()) {
    const std::string_view key = next_key(text);
    if (key.empty()) return Outcome::kForeign;
    const int number = next_number(text);
    if (const Outcome outcome = store_pair(key, number, max, line); outcome != Outcome::kOk) {
      return outcome;
    }
  }
  return line.has_hand() || line.has_info.any() ? Outcome::kOk : Outcome::kShort;
}

Outcome parse_legacy(std::string_view text, int max, Line& line) noexcept {
  std::array<int, kLegacyValues> values{};
  for (std::size_t i = 0; i < kLegacyValues; ++i) {
    values[i] = next_number(text);
    const bool last = i + 1 == kLegacyValues;
    if (values[i] < 0) return Outcome::kForeign;
    if (text.empty() != last) return last ? Outcome::kForeign : Outcome::kShort;
    if (last) break;
    if (text.front() != '&') return Outcome::kForeign;
    text.remove_prefix(1);
  }
  const std::size_t analog = kLegacyValues - kLegacyButtons;
  for (std::size_t i = 0; i < analog; ++i) {
    const std::size_t place = i < kFingers ? kCurl + i : kJoyX + i - kFingers;
    if (values[i] > max) return Outcome::kOutOfRange;
    line.value[place] = values[i];
    line.has[place] = true;
  }
  for (std::size_t i = 0; i < kLegacyButtons; ++i) {
    if (values[analog + i] > 1) return Outcome::kOutOfRange;
    line.pressed[i] = values[analog + i] != 0;
  }
  return Outcome::kOk;
}

void add_value(std::string& text, const std::string& key, const Line& line, std::size_t place) {
  if (line.has[place]) text += key + std::to_string(line.value[place]);
}

}  // namespace

RT_SAFE bool Line::has_hand() const noexcept {
  for (std::size_t i = kCurl; i < kSplay; ++i) {
    if (has[i]) return true;
  }
  return false;
}

RT_SAFE Outcome parse_line(std::string_view text, Encoding encoding, int max, Line& line) noexcept {
  line = {};
  if (encoding == Encoding::kAuto) {
    const bool joined = text.find('&') != std::string_view::npos;
    encoding = joined ? Encoding::kLegacy : Encoding::kAlpha;
  }
  return encoding == Encoding::kLegacy ? parse_legacy(text, max, line)
                                       : parse_alpha(text, max, line);
}

std::string alpha_line(const Line& line) {
  std::string text;
  if (line.has_info.any()) text += 'Z';
  const std::array<std::string, 3> info_keys{"(ZV)", "(ZG)", "(ZH)"};
  for (std::size_t i = 0; i < info_keys.size(); ++i) {
    if (line.has_info[i]) text += info_keys[i] + std::to_string(line.info[i]);
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto finger = static_cast<char>('A' + f);
    add_value(text, {finger}, line, kCurl + f);
    for (std::size_t j = 0; j < kJoints; ++j) {
      const auto joint = static_cast<char>('A' + j);
      add_value(text, {'(', finger, 'A', joint, ')'}, line, kJoint + f * kJoints + j);
    }
    add_value(text, {'(', finger, 'B', ')'}, line, kSplay + f);
  }
  add_value(text, "F", line, kJoyX);
  add_value(text, "G", line, kJoyY);
  add_value(text, "P", line, kTrigger);
  for (std::size_t b = 0; b < kButtons; ++b) {
    if (line.pressed[b]) text += static_cast<char>('H' + b);
  }
  return text + '\n';
}

std::string legacy_line(const Line& line) {
  std::string text;
  for (std::size_t f = 0; f < kFingers; ++f) text += std::to_string(line.value[kCurl + f]) + '&';
  text += std::to_string(line.value[kJoyX]) + '&' + std::to_string(line.value[kJoyY]);
  for (std::size_t b = 0; b < kLegacyButtons; ++b) text += line.pressed[b] ? "&1" : "&0";
  return text + '\n';
}

std::string force_line(const Forces& forces, Encoding encoding) {
  std::string text;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (encoding == Encoding::kLegacy) {
      text += (f == 0 ? "" : "&") + std::to_string(forces[f]);
    } else {
      text += static_cast<char>('A' + f) + std::to_string(forces[f]);
    }
  }
  return text + '\n';
}

std::string vibration_line(double frequency_hz, double duration_s, double strength) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), "F%.2fG%.2fH%.2f\n", frequency_hz, duration_s,
                      strength);
  return text.data();
}

void apply_force_line(std::string_view text, Forces& forces) {
  if (text.size() < kMinMessage) return;
  const std::string line(text);
  const bool legacy = line.find('&') != std::string::npos;
  std::size_t at = 0;
  for (std::size_t f = 0; f < kFingers; ++f) {
    if (legacy) {
      if (f > 0) at = line.find('&', at);
      if (at == std::string::npos) return;
      at += f > 0 ? 1 : 0;
    } else {
      at = line.find(static_cast<char>('A' + f));  // the firmware takes the first such letter
      if (at == std::string::npos) continue;
      ++at;
    }
    const long force = std::strtol(line.c_str() + at, nullptr, 10);
    if (force >= 0) forces[f] = static_cast<int>(std::min(force, long{kMaxAnalog}));
  }
}

}  // namespace posed::drivers::lucidgloves
