// The emulated box's command set. A command is one letter: upper case for binary, lower case for
// ASCII; a '?' before it makes a query, a '1' a command of the CyberGlove III. Every answer ends
// with a NUL.
#include "drivers/cyberglove/emulator.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"

namespace posed::drivers::cyberglove {

namespace {

constexpr std::int64_t kNs = 78125, kTicks = 9;  // 9 ticks of 1/115200 s are 78125 ns
constexpr std::int64_t kMinPeriod_ticks = 768;   // 150 Hz: the result of "as fast as possible"
constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

CyberGloveEmulator::CyberGloveEmulator(EmulatorSettings settings, glove::Model model,
                                       std::shared_ptr<const glove::Calibration> calibration)
    : settings_(std::move(settings)),
      model_(std::move(model)),
      calibration_(std::move(calibration)),
      sub_frame_(settings_.first_sub_frame) {
  power_up();
  pose_hand(HandAngles{});
}

Result<std::unique_ptr<CyberGloveEmulator>> CyberGloveEmulator::make(EmulatorSettings settings) {
  auto model = TRY(glove_model(settings.hand));
  auto calibration = TRY(glove::default_calibration(model));
  return std::unique_ptr<CyberGloveEmulator>(
      new CyberGloveEmulator(std::move(settings), std::move(model), std::move(calibration)));
}

void CyberGloveEmulator::pose_hand(const HandAngles& angles) {
  std::array<double, kSensors> value{};
  const auto rows = std::span(calibration_->map).first(calibration_->map_rows);
  for (const glove::MapRow& row : rows) {
    const double angle = angles[row.channel];
    if (std::isfinite(angle)) value[row.sensor] = (angle - row.offset_rad) / row.gain;
  }
  uncompute_angles(settings_.hand, value);
  for (std::size_t i = 0; i < kSensors; ++i)
    raw_[i] = glove::raw_at(calibration_->curve[i], value[i]);
}

void CyberGloveEmulator::start(Streaming what) {
  streaming_ = what;
  start_ns_ = now_ns_;
  records_ = 0;
}

// Due time of the n-th record after the start; rounding errors do not accumulate.
std::int64_t CyberGloveEmulator::due_after_start_ns(std::int64_t records) const {
  if (streaming_ == Streaming::k16Bit) {
    return records * divider_ * kSecond_ns / (std::int64_t{kFrames_hz} * multiplier_);
  }
  const std::int64_t ticks = period_.ticks() == 0 ? kMinPeriod_ticks : period_.ticks();
  return records * ticks * kNs / kTicks;
}

std::int64_t CyberGloveEmulator::next_due_ns() const {
  if (streaming_ == Streaming::kNo) return kNoTime_ns;
  return start_ns_ + due_after_start_ns(records_ + 1);
}

void CyberGloveEmulator::emit(std::int64_t now_ns, Bytes& out) {
  now_ns_ = now_ns;
  if (streaming_ == Streaming::kNo) return;
  const std::int64_t due_ns = next_due_ns();
  ++records_;
  switch (streaming_) {
    case Streaming::k8Bit:
      return add_sample(lead(flags_.at('Y') != 0 ? Mode::kSync : Mode::kStream), due_ns, out);
    case Streaming::kAscii:
      return add_ascii_sample('s', out);
    default:
      return add_record(out);
  }
}

CyberGloveEmulator::Values CyberGloveEmulator::sample_values() const {
  Values values;
  const std::size_t count = flags_.at('N');
  for (std::size_t i = 0; i < kSensors && values.size() < count; ++i) {
    if ((mask_ >> i & 1U) == 0) continue;
    const bool stuck = settings_.stuck_sensor == static_cast<int>(i);
    const double raw = stuck ? settings_.stuck_at : raw_[i];
    values.push_back(static_cast<unsigned>(std::clamp(std::round(raw), 1.0, 255.0)));
  }
  return values;
}

void CyberGloveEmulator::add_sample(std::byte first, std::int64_t at_ns, Bytes& out) const {
  out.push_back(first);
  for (const unsigned value : sample_values()) out.push_back(static_cast<std::byte>(value));
  if (flags_.at('D') != 0) {
    const std::int64_t ticks = ((at_ns - *power_up_ns_) * kTicks + kNs / 2) / kNs;
    const auto stamp = encode_stamp(settings_.first_count + static_cast<std::uint32_t>(ticks));
    out.insert(out.end(), stamp.begin(), stamp.end());
  }
  if (flags_.at('U') != 0) {
    std::byte status = kStatusMark;
    if (settings_.plugged_in) status |= kPluggedIn;
    if (flags_.at('W') != 0) status |= kSwitch;
    if (flags_.at('L') != 0) status |= kLight;
    out.push_back(status);
  }
  if (settings_.too_fast) add("es", out);
  if (!settings_.plugged_in) add("eg", out);
  out.push_back(std::byte{0});
}

void CyberGloveEmulator::add_ascii_sample(char first, Bytes& out) const {
  add({&first, 1}, out);
  for (const unsigned value : sample_values()) add(" " + std::to_string(value), out);
  add(std::string_view("\r\n\0", 3), out);
}

void CyberGloveEmulator::add_record(Bytes& out) {
  if (settings_.stray_echo) add("e1S", out);
  const auto head = encode_time_of_day(sub_frame_, static_cast<int>(multiplier_));
  out.insert(out.end(), head.begin(), head.end());
  for (std::size_t i = 0; i < kSensors; ++i) {
    if ((kMask22 >> i & 1U) == 0) continue;
    const bool stuck = settings_.stuck_sensor == static_cast<int>(i);
    const double raw = stuck ? settings_.stuck_at : raw_[i];
    const bool fitted = (settings_.mask >> i & 1U) != 0;
    const auto value =
        static_cast<unsigned>(fitted ? std::clamp(std::round(raw * 16.0), 1.0, 4094.0) : 0.0);
    out.push_back(static_cast<std::byte>(value >> 8));
    out.push_back(static_cast<std::byte>(value & 0xFF));
  }
  out.insert(out.end(), kRecordEnd.begin(), kRecordEnd.end());
  sub_frame_ = (sub_frame_ + divider_) % sub_frames_a_day(static_cast<int>(multiplier_));
}

namespace {

constexpr char kStop = 0x03, kInitialise = 0x09, kReboot = 0x12;
constexpr std::string_view kUnknown(" e?\r\n\0", 6);
constexpr std::size_t kMaxCommandBytes = 64;  // ASCII, up to its CR

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
    if (input.size() < kMaxCommandBytes) return 0;
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
