#include "drivers/cyberglove/emulator.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/calibration_file.hpp"

namespace posed::drivers::cyberglove {
namespace {

constexpr std::int64_t kNs = 78125, kTicks = 9;  // 9 ticks of 1/115200 s are 78125 ns
constexpr std::int64_t kFastest_ticks = 768;     // 150 Hz: the result of "as fast as possible"
constexpr std::int64_t kSecond_ns = 1'000'000'000;

double raw_of(const glove::Curve& line, double value) {
  const double slope = (static_cast<double>(line.value[1]) - line.value[0]) /
                       (static_cast<double>(line.raw[1]) - line.raw[0]);
  return line.raw[0] + (value - line.value[0]) / slope;
}

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
  auto model = glove_model(settings.hand);
  if (!model) return std::unexpected(model.error());
  auto calibration = glove::default_calibration(*model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::unique_ptr<CyberGloveEmulator>(
      new CyberGloveEmulator(std::move(settings), std::move(*model), std::move(*calibration)));
}

void CyberGloveEmulator::pose_hand(const HandAngles& angles) {
  std::array<double, kSensors> value{};
  const auto rows = std::span(calibration_->map).first(calibration_->map_rows);
  for (const glove::MapRow& row : rows) {
    const double angle = angles[row.channel];
    if (std::isfinite(angle)) value[row.sensor] = (angle - row.offset_rad) / row.gain;
  }
  uncompute_angles(settings_.hand, value);
  for (std::size_t i = 0; i < kSensors; ++i) raw_[i] = raw_of(calibration_->curve[i], value[i]);
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
  const std::int64_t ticks = period_.ticks() == 0 ? kFastest_ticks : period_.ticks();
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

}  // namespace posed::drivers::cyberglove
