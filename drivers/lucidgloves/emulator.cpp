#include "drivers/lucidgloves/emulator.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/degree.hpp"

namespace posed::drivers::lucidgloves {
namespace {

constexpr std::int64_t kPeriod_ns = 5'000'000;  // some firmware is faster; hosts must keep up
constexpr int kFirmware = 5;

// Angles of a fully curled finger, as in config/devices/lucidgloves.toml; joints 0 to 3. A joint
// with 0 is not sent.
constexpr std::array<double, kJoints> kThumb_rad{0.0, 60.0 * kDegree, 80.0 * kDegree, 0.0};
constexpr std::array<double, kJoints> kFinger_rad{0.0, 90.0 * kDegree, 100.0 * kDegree,
                                                  70.0 * kDegree};
constexpr double kSplay_rad = 20.0 * kDegree;

}  // namespace

LucidEmulator::LucidEmulator(const Settings& settings) : settings_(settings), pace_(kPeriod_ns) {
  pace_.start(0);
  pose_hand({});
}

void LucidEmulator::pose_hand(const HandAngles& angles) {
  line_ = {};
  const int max = settings_.max_analog;
  const auto set = [&](std::size_t place, double share) {
    line_.has[place] = true;
    line_.value[place] = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * max));
  };
  for (std::size_t f = 0; f < kFingers; ++f) {
    const auto& whole = f == 0 ? kThumb_rad : kFinger_rad;
    double sum = 0.0;
    int joints = 0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (whole[j] == 0.0) continue;
      // Joint 1 of the thumb is hand45's second joint; of a finger it is the first.
      const std::size_t joint = f == 0 ? j : j - 1;
      const double share = angles[f * kFingerChannels + 3 * joint] / whole[j];
      set(kJoint + f * kJoints + j, share);
      sum += share;
      ++joints;
    }
    set(kCurl + f, sum / joints);
    set(kSplay + f, 0.5 + 0.5 * angles[f * kFingerChannels + 1] / kSplay_rad);
  }
  set(kJoyX, 0.5);
  set(kJoyY, 0.5);
  // The firmware recognises gestures: more than half closed counts as pressed.
  const auto curl = [&](std::size_t f) { return line_.value[kCurl + f]; };
  line_.pressed[1] = 2 * curl(1) > max;                                // trigger
  line_.pressed[4] = curl(1) + curl(2) + curl(3) + curl(4) > 2 * max;  // grab
  line_.pressed[5] = curl(0) + curl(1) > max;                          // pinch
}

void LucidEmulator::receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) {
  for (const std::byte byte : bytes) {
    const char c = static_cast<char>(byte);
    if (c == '\n') {
      obey(command_, now_ns, answer);
      command_.clear();
    } else if (command_.size() < kMaxLine) {
      command_ += c;
    }
  }
}

void LucidEmulator::obey(const std::string& command, std::int64_t now_ns, Bytes& answer) {
  std::string rest = command;
  const auto consume = [&rest](const std::string& key) {
    const std::size_t at = rest.find(key);
    if (at != std::string::npos) rest.erase(at, key.size());
    return at != std::string::npos;
  };
  const bool starts = consume("(ZA)");
  const bool stops = consume("(ZZ)");
  if (stops) pace_.stop();
  if (starts && !pace_.running()) pace_.start(now_ns);
  if (consume("Z")) {
    Line info;
    info.has_info.set();
    info.info = {kFirmware, 0, settings_.hand == Side::kRight ? 1 : 0};
    glove::add_text(alpha_line(info), answer);
  }
  if (rest.starts_with('F')) {
    vibration_ = rest;
  } else {
    apply_force_line(rest, forces_);
  }
}

void LucidEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (!pace_.running()) return;
  pace_.step(now_ns);
  glove::add_text(settings_.encoding == Encoding::kLegacy ? legacy_line(line_) : alpha_line(line_),
                  out);
}

}  // namespace posed::drivers::lucidgloves
