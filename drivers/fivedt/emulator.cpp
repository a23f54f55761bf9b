#include "drivers/fivedt/emulator.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::drivers::fivedt {
namespace {

constexpr int kInfoEvery = 64;  // records of a Data Glove 16

// Sample periods: as long as the line needs for 9 or 36 bytes, or a likely rate.
constexpr std::array<std::int64_t, 6> kPeriod_ns{10'000'000, 12'500'000, 20'000'000,
                                                 13'333'333, 16'666'667, 16'666'667};

// Angles of a fully bent sensor, as in config/devices/fivedt-*.toml: a finger's three joints, a
// thumb's last two.
constexpr std::array<double, kFingerJoints> kFinger_rad{90.0 * kDegree, 100.0 * kDegree,
                                                        70.0 * kDegree};
constexpr std::array<double, kFingerJoints> kThumb_rad{0.0, 60.0 * kDegree, 80.0 * kDegree};
constexpr double kSpread_rad = 20.0 * kDegree;

double share(const HandAngles& angles, std::size_t finger, std::size_t joint) {
  const double whole = (finger == 0 ? kThumb_rad : kFinger_rad)[joint];
  return angles[finger * kFingerChannels + 3 * joint] / whole;
}

double spread(const HandAngles& angles, std::size_t finger) {
  return angles[finger * kFingerChannels + 1] / kSpread_rad;
}

// How far each sensor is bent: the mean of its finger's joints.
std::array<double, kMaxValues> narrow_bends(const HandAngles& angles) {
  std::array<double, kMaxValues> bends{};
  bends[0] = 0.5 * (share(angles, 0, 1) + share(angles, 0, 2));
  for (std::size_t f = 1; f < kFingers; ++f) {
    bends[f] = (share(angles, f, 0) + share(angles, f, 1) + share(angles, f, 2)) / 3.0;
  }
  return bends;
}

std::array<double, kMaxValues> wide_bends(const HandAngles& angles) {
  std::array<double, kMaxValues> bends{};
  for (std::size_t f = 0; f < kFingers; ++f) {
    bends[3 * f] = share(angles, f, f == 0 ? 1 : 0);
    bends[3 * f + 1] =
        f == 0 ? share(angles, 0, 2) : 0.5 * (share(angles, f, 1) + share(angles, f, 2));
  }
  bends[2] = spread(angles, 0);
  bends[5] = spread(angles, 1);
  bends[8] = spread(angles, 3);
  bends[11] = spread(angles, 4) - spread(angles, 3);
  return bends;
}

}  // namespace

FiveDtEmulator::FiveDtEmulator(const Settings& settings)
    : settings_(settings), pace_(kPeriod_ns[static_cast<std::size_t>(settings.form)]) {
  if (settings.form != Form::kFive) pace_.start(0);
  pose_hand({});
}

void FiveDtEmulator::pose_hand(const HandAngles& angles) {
  const Form form = settings_.form;
  const bool bytes = form == Form::kFive || form == Form::kFiveWireless;
  const auto bends = sensors_of(form) == kFingers ? narrow_bends(angles) : wide_bends(angles);
  reading_ = {.pitch = 128, .roll = 128, .port_b = settings_.port_b};
  for (std::size_t i = 0; i < sensors_of(form); ++i) {
    const double value = bytes
                             ? std::clamp(255.0 * bends[i], 0.0, 255.0)
                             : std::clamp(kStraight + (kBent - kStraight) * bends[i], 0.0, 4095.0);
    reading_.value[value_of_sensor(form, i)] = static_cast<std::uint16_t>(std::lround(value));
  }
}

void FiveDtEmulator::receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) {
  if (settings_.form != Form::kFive) return;  // the other models ignore commands
  for (const std::byte byte : bytes) {
    switch (static_cast<char>(byte)) {
      case 'A':
        pace_.stop();
        answer.push_back(kReady);
        break;
      case 'G': {
        const auto info = encode_info(settings_.hand);
        answer.insert(answer.end(), info.begin(), info.end());
        break;
      }
      case 'C':
        send(reading_, answer);
        break;
      case 'D':
        if (!pace_.running()) pace_.start(now_ns);
        break;
      default:
        break;  // the answer is not known
    }
  }
}

void FiveDtEmulator::send(const Reading& reading, Bytes& out) const {
  const auto bytes = encode_packet(settings_.form, reading, settings_.hand);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void FiveDtEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (!pace_.running()) return;
  pace_.step(now_ns);
  send(reading_, out);
  if (settings_.form == Form::kFive) out.push_back(kReady);
  if (settings_.form == Form::kSixteen && records_++ % kInfoEvery == 0) {
    send({.kind = Reading::Kind::kInfo, .right = settings_.hand == Side::kRight}, out);
  }
}

}  // namespace posed::drivers::fivedt
