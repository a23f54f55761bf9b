#include "drivers/p5/emulator.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::drivers::p5 {
namespace {

constexpr std::int64_t kPeriod_ns = 20'000'000;  // users of libp5glove report 40 to 60 per second

// Angles of a fully bent finger, as in config/devices/p5.toml.
constexpr std::array<double, kFingerJoints> kFinger_rad{90.0 * kDegree, 100.0 * kDegree,
                                                        70.0 * kDegree};
constexpr std::array<double, kFingerJoints> kThumb_rad{0.0, 60.0 * kDegree, 80.0 * kDegree};

double bend(const HandAngles& angles, std::size_t finger) {
  const auto& whole = finger == 0 ? kThumb_rad : kFinger_rad;
  double sum = 0.0;
  int joints = 0;
  for (std::size_t j = 0; j < whole.size(); ++j) {
    if (whole[j] == 0.0) continue;
    sum += angles[finger * kFingerChannels + 3 * j] / whole[j];
    ++joints;
  }
  return std::clamp(sum / joints, 0.0, 1.0);
}

}  // namespace

std::array<std::byte, kHeadsBytes> emulated_heads() {
  return {std::byte{kHeadsReport}, {}, {}, {}, {}, std::byte{80}};
}

std::array<std::byte, kFirmwareBytes> emulated_firmware() {
  return {std::byte{kFirmwareReport}, std::byte{4}, std::byte{3}};
}

std::array<std::byte, kLedsBytes> emulated_leds() {
  // 1/100 inch: around the hand, no three on one line.
  constexpr std::array<std::array<int, 3>, kLeds> kPlaces{{{-250, 20, 170},
                                                           {240, -30, -30},
                                                           {-170, 30, -50},
                                                           {40, 100, -10},
                                                           {170, -20, -90},
                                                           {200, 10, 210},
                                                           {-280, -60, 150},
                                                           {190, -70, 210}}};
  std::array<std::byte, kLedsBytes> bytes{std::byte{kLedsReport}};
  for (std::size_t i = 0; i < kLeds; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int value = k == 0 ? -kPlaces[i][k] : kPlaces[i][k];
      bytes[2 + 6 * i + 2 * k] = static_cast<std::byte>(value >> 8 & 0xFF);
      bytes[2 + 6 * i + 2 * k + 1] = static_cast<std::byte>(value & 0xFF);
    }
  }
  return bytes;
}

P5Emulator::P5Emulator() : pace_(kPeriod_ns) {
  pace_.start(0);
  const CameraRig rig = CameraRig::of(emulated_heads(), emulated_leds());
  const Eigen::Vector3d palm_m(0.05, 0.02, 0.5);
  for (std::size_t i = 0; i < kSpots; ++i) {
    const std::size_t led = 2 * i;
    report_.spot[i] = rig.project(led, palm_m + rig.led_m[led]);
  }
  pose_hand({});
}

void P5Emulator::pose_hand(const HandAngles& angles) {
  for (std::size_t f = 0; f < kFingers; ++f) {
    report_.bend[f] = static_cast<std::uint8_t>(std::lround(kMaxBend * bend(angles, f)));
  }
}

void P5Emulator::receive(std::span<const std::byte> /*bytes*/, std::int64_t /*now_ns*/,
                         Bytes& /*answer*/) {
  // The host queries a P5 by control transfers, not in this stream.
}

void P5Emulator::emit(std::int64_t now_ns, Bytes& out) {
  pace_.step(now_ns);
  const auto bytes = encode_report(report_);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace posed::drivers::p5
