// The emulated box's command set. A command is one letter: upper case for binary, lower case for
// ASCII; a '?' before it makes a query, a '1' a command of the CyberGlove III. Every answer ends
// with a NUL.
#include <algorithm>
#include <bit>
#include <sstream>

#include "drivers/cyberglove/emulator.hpp"

namespace posed::drivers::cyberglove {
namespace {

constexpr char kStop = 0x03, kInitialise = 0x09, kReboot = 0x12;
constexpr std::string_view kUnknown(" e?\r\n\0", 6);
constexpr std::size_t kLongestCommand = 64;  // ASCII, up to its CR

char upper(char letter) { return static_cast<char>(letter - 'a' + 'A'); }

bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

// Number of payload bytes of a binary set command; 0 for a letter that sets nothing.
std::size_t payload_bytes(char letter) {
  if (std::string_view("BDFJLNQUWY").contains(letter)) return 1;
  if (letter == 'M' || letter == 'P') return 3;
  return letter == 'T' ? 4 : 0;
}

unsigned byte_at(std::string_view text, std::size_t i) {
  return static_cast<unsigned char>(text[i]);
}

std::vector<unsigned> mask_bytes(std::uint32_t mask) {
  return {mask & 0xFF, mask >> 8 & 0xFF, mask >> 16 & 0xFF};
}

}  // namespace

void CyberGloveEmulator::add(std::string_view text, Bytes& out) {
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
}

void CyberGloveEmulator::power_up() {
  flags_ = {{'B', 0}, {'D', 0}, {'F', 1},
            {'J', 1}, {'L', 0}, {'N', static_cast<unsigned>(std::popcount(settings_.mask))},
            {'Q', 0}, {'U', 0}, {'W', 0},
            {'Y', 0}};
  mask_ = settings_.mask;
  period_ = {.w1 = 1920, .w2 = 1};
  touch_ = {};
  multiplier_ = divider_ = 1;
  streaming_ = Streaming::kNo;
}

void CyberGloveEmulator::receive(std::span<const std::byte> bytes, std::int64_t now_ns,
                                 Bytes& answer) {
  now_ns_ = now_ns;
  if (!power_up_ns_) power_up_ns_ = now_ns;
  for (const std::byte byte : bytes) input_.push_back(static_cast<char>(byte));
  while (!input_.empty()) {
    const std::size_t used = handle_command(input_, answer);
    if (used == 0) return;
    input_.erase(0, used);
  }
}

std::size_t CyberGloveEmulator::handle_command(std::string_view input, Bytes& answer) {
  const char c = input[0];
  if (c == '\r' || c == '\n') return 1;
  if (c == kStop) {
    streaming_ = Streaming::kNo;
    add(std::string_view("\x03\0", 2), answer);
    return 1;
  }
  if (c == kInitialise) {
    add(std::string_view("\x09\0", 2), answer);
    return 1;
  }
  if (c == kReboot) {
    power_up();
    add(std::string_view("\x12\r\n\0", 4), answer);
    return 1;
  }
  if (c == '!' && settings_.level_one) {  // "!!!" stops a III
    if (input.size() < 3) return 0;
    if (input.starts_with("!!!")) streaming_ = Streaming::kNo;
    return 3;
  }
  if (c == '?') return handle_query(input, answer);
  if (c == '1' && settings_.level_one) return handle_level_one(input, answer);
  if (is_upper(c)) return handle_binary_set(input, answer);
  if (is_lower(c)) return handle_ascii_set(input, answer);
  // "^" sets the control mode of the II and III, so the two characters "^c" do not mean stop.
  const std::size_t size = c == '^' ? 2 : 1;
  if (input.size() < size) return 0;
  add(kUnknown, answer);
  return size;
}

std::size_t CyberGloveEmulator::handle_query(std::string_view input, Bytes& answer) const {
  if (input.size() < 2) return 0;
  const char letter = input[1];
  if (letter == 'i' || letter == 'I') {
    add(std::string("?") + letter + " " + settings_.info + "\r\n", answer);
    answer.push_back(std::byte{0});
    return 2;
  }
  const bool ascii = is_lower(letter);
  const auto values = state_of(ascii ? upper(letter) : letter);
  if (!values) {
    add(kUnknown, answer);
    return 2;
  }
  add(input.substr(0, 2), answer);
  for (const unsigned value : *values) {
    if (ascii) {
      add(" " + std::to_string(value), answer);
    } else {
      if (letter == 'T') answer.push_back(static_cast<std::byte>(value >> 8));
      answer.push_back(static_cast<std::byte>(value & 0xFF));
    }
  }
  if (ascii) add("\r\n", answer);
  answer.push_back(std::byte{0});
  return 2;
}

std::size_t CyberGloveEmulator::handle_binary_set(std::string_view input, Bytes& answer) {
  const char letter = input[0];
  if (letter == 'S') {
    start(Streaming::k8Bit);
    return 1;
  }
  if (letter == 'G') {
    add_sample(std::byte{'G'}, now_ns_, answer);
    return 1;
  }
  if (letter == 'A') return handle_touch(input, answer);
  const std::size_t payload = payload_bytes(letter);
  if (payload == 0) {
    add(kUnknown, answer);
    return 1;
  }
  if (input.size() < 1 + payload) return 0;
  Values values;
  for (std::size_t i = 1; i <= payload; ++i) values.push_back(byte_at(input, i));
  if (letter == 'T') values = {values[0] << 8 | values[1], values[2] << 8 | values[3]};
  if (set_state(letter, values)) {
    add(input.substr(0, 1), answer);
    answer.push_back(std::byte{0});
  } else {
    add(std::string_view("en\0", 3), answer);
  }
  return 1 + payload;
}

std::size_t CyberGloveEmulator::handle_ascii_set(std::string_view input, Bytes& answer) {
  if (input[0] == 's') {
    start(Streaming::kAscii);
    return 1;
  }
  if (input[0] == 'g') {
    add_ascii_sample('g', answer);
    return 1;
  }
  if (payload_bytes(upper(input[0])) == 0) {
    add(kUnknown, answer);
    return 1;
  }
  const std::size_t end = input.find('\r');
  if (end == std::string_view::npos) {
    if (input.size() < kLongestCommand) return 0;
    add(kUnknown, answer);
    return input.size();
  }
  std::istringstream words{std::string(input.substr(1, end - 1))};
  Values values;
  for (unsigned value = 0; words >> value;) values.push_back(value);
  if (set_state(upper(input[0]), values)) {
    add(input.substr(0, end), answer);
    answer.push_back(std::byte{0});
  } else {
    add(std::string_view("en\0", 3), answer);
  }
  return end + 1;
}

// CyberTouch: A n, then n pairs (motor, strength); or A 255 and six strengths.
std::size_t CyberGloveEmulator::handle_touch(std::string_view input, Bytes& answer) {
  constexpr unsigned kAll = 255;
  if (input.size() < 2) return 0;
  const unsigned count = byte_at(input, 1);
  const std::size_t size = 2 + (count == kAll ? touch_.size() : std::size_t{2} * count);
  if (input.size() < size) return 0;
  for (std::size_t i = 0; count == kAll && i < touch_.size(); ++i) {
    touch_[i] = byte_at(input, 2 + i);
  }
  for (std::size_t i = 0; count != kAll && i < count; ++i) {
    const unsigned motor = byte_at(input, 2 + 2 * i);
    if (motor < touch_.size()) touch_[motor] = byte_at(input, 3 + 2 * i);
  }
  add(std::string_view("A\0", 2), answer);
  return size;
}

std::size_t CyberGloveEmulator::handle_level_one(std::string_view input, Bytes& answer) {
  constexpr std::size_t kSize = 3;
  if (input.size() < 2) return 0;
  if (input[1] == 'S' || input[1] == 'G') {  // the echo has no end mark; records follow at once
    add(input.substr(0, 2), answer);
    if (input[1] == 'S') start(Streaming::k16Bit);
    if (input[1] == 'G') add_record(answer);
    return 2;
  }
  if (!std::string_view("edmuwso").contains(input[1])) {
    add(kUnknown, answer);
    return 2;
  }
  if (input.size() < kSize) return 0;
  const unsigned value = byte_at(input, 2);
  if (input[1] == 'm' && value >= 1 && value <= static_cast<unsigned>(kMaxMultiplier)) {
    multiplier_ = value;
  }
  if ((input[1] == 'u' || input[1] == 'w') && value >= 1) divider_ = value;
  add(input.substr(0, kSize), answer);
  answer.push_back(std::byte{0});
  return kSize;
}

std::array<unsigned, 3> CyberGloveEmulator::parameter_flags() const {
  const unsigned status = 0x80U | (settings_.plugged_in ? 1U : 0U);
  const unsigned right = settings_.hand == Side::kRight ? 1U : 0U;
  return {status,
          flags_.at('Y') | flags_.at('U') << 2 | flags_.at('J') << 3 | flags_.at('F') << 4 |
              flags_.at('D') << 5 | right << 6 | (settings_.plugged_in ? 0x80U : 0U),
          flags_.at('Q')};
}

// The answer to a query of this letter: 16-bit words for T, bytes for all others.
std::optional<CyberGloveEmulator::Values> CyberGloveEmulator::state_of(char letter) const {
  switch (letter) {
    case 'A':
      return Values(touch_.begin(), touch_.end());
    case 'G':
      return Values{settings_.plugged_in ? 3U : 1U};
    case 'S':
      return Values{static_cast<unsigned>(std::popcount(settings_.mask))};
    case 'R':
      return Values{settings_.hand == Side::kRight ? 1U : 0U};
    case 'K':
      return mask_bytes(settings_.mask);
    case 'M':
      return mask_bytes(mask_);
    case 'P': {
      const auto flags = parameter_flags();
      return Values(flags.begin(), flags.end());
    }
    case 'T':  // a III answers zeros
      return settings_.level_one ? Values{0, 0} : Values{period_.w1, period_.w2};
    case 'V':
      return Values{2, 1, 2, 1};
    default:
      break;
  }
  const auto flag = flags_.find(letter);
  if (flag == flags_.end() || letter == 'Y') return std::nullopt;
  return Values{flag->second};
}

bool CyberGloveEmulator::set_state(char letter, const Values& values) {
  const std::size_t wanted = letter == 'T' ? 2 : payload_bytes(letter);
  if (values.size() != wanted) return false;
  const unsigned most = letter == 'T' ? 0xFFFF : 0xFF;
  if (std::ranges::any_of(values, [&](unsigned value) { return value > most; })) return false;
  if (letter == 'M') {
    mask_ = (values[0] | values[1] << 8 | values[2] << 16) & settings_.mask;
  } else if (letter == 'T') {
    period_ = {.w1 = static_cast<std::uint16_t>(values[0]),
               .w2 = static_cast<std::uint16_t>(values[1])};
  } else if (letter == 'P') {
    flags_['U'] = values[1] >> 2 & 1;
    flags_['D'] = values[1] >> 5 & 1;
    flags_['F'] = values[1] >> 4 & 1;
    flags_['Q'] = values[2] & 1;
  } else {
    flags_[letter] = values[0];
    // The emulator's own period serves as the sync input.
    if (letter == 'Y' && values[0] != 0) start(Streaming::k8Bit);
  }
  return true;
}

}  // namespace posed::drivers::cyberglove
