#include "daemon/tools/emulate/emulated_device.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "daemon/system/clock.hpp"
#include "drivers/glove/glove_emulator.hpp"

namespace posed::emulate {
namespace {

// How long it may take until a stop is noticed.
constexpr std::int64_t kLookEvery_ns = 50'000'000;
// After the process was suspended, the device does not send everything that it missed.
constexpr int kPacketsInARow = 16;

}  // namespace

HandAngles pose_at(const clip::HandClip& clip, double time_s) {
  const double begin_s = clip.time_s.front();
  const double length_s = clip.time_s.back() - begin_s;
  const double at_s = begin_s + (length_s > 0.0 ? std::fmod(std::max(time_s, 0.0), length_s) : 0.0);
  const auto next = std::ranges::upper_bound(clip.time_s, at_s);
  const auto after = std::min<std::size_t>(static_cast<std::size_t>(next - clip.time_s.begin()),
                                           clip.time_s.size() - 1);
  const std::size_t before = after == 0 ? 0 : after - 1;
  const double step_s = clip.time_s[after] - clip.time_s[before];
  const double share = step_s > 0.0 ? (at_s - clip.time_s[before]) / step_s : 0.0;
  HandAngles pose{};
  for (std::size_t i = 0; i < pose.size(); ++i) {
    const double value = std::lerp(clip.angles[before][i], clip.angles[after][i], share);
    pose[i] = std::isfinite(value) ? value : 0.0;
  }
  return pose;
}

Motion hand_motion(std::function<HandAngles(double time_s)> angles_at) {
  return [angles_at = std::move(angles_at)](double time_s, drivers::Emulator& emulator) {
    emulator.pose(0, drivers::glove::hand_frame(angles_at(time_s)));
  };
}

EmulatedDevice::EmulatedDevice(std::unique_ptr<drivers::Emulator> emulator, EmulatedPort port,
                               Motion motion, Settings settings)
    : emulator_(std::move(emulator)),
      port_(std::move(port)),
      motion_(std::move(motion)),
      settings_(std::move(settings)) {}

void EmulatedDevice::run(const std::stop_token& stop) {
  const std::int64_t start_ns = system::monotonic_ns();
  const auto device_time_ns = [&] {
    return static_cast<std::int64_t>(static_cast<double>(system::monotonic_ns() - start_ns) *
                                     settings_.speed);
  };
  while (!stop.stop_requested()) {
    const std::int64_t due_ns = emulator_->next_due_ns();
    std::int64_t wait_ns = kLookEvery_ns;
    if (due_ns != kNoTime_ns) {
      const auto until_ns = static_cast<std::int64_t>(
          static_cast<double>(due_ns - device_time_ns()) / std::max(settings_.speed, 1e-3));
      wait_ns = std::clamp<std::int64_t>(until_ns, 0, kLookEvery_ns);
    }
    const auto heard = port_.receive(std::chrono::nanoseconds(wait_ns));
    if (!heard) return;
    const std::int64_t now_ns = device_time_ns();
    if (motion_) motion_(seconds(now_ns), *emulator_);
    if (!heard->bytes.empty()) {
      Bytes answer;
      emulator_->receive_socket(heard->socket, heard->bytes, now_ns, answer);
      port_.send(heard->socket, answer);
    }
    emit(now_ns);
  }
}

void EmulatedDevice::emit(std::int64_t device_ns) {
  for (int i = 0; i < kPacketsInARow; ++i) {
    const std::int64_t due_ns = emulator_->next_due_ns();
    if (due_ns == kNoTime_ns || due_ns > device_ns) return;
    packet_.clear();
    const std::uint8_t socket = emulator_->next_socket();
    emulator_->emit(device_ns, packet_);
    ++packets_;
    for (auto& fault : settings_.faults) {
      passed_.clear();
      static_cast<void>(fault.pass(packet_, device_ns, passed_));
      std::swap(packet_, passed_);
    }
    port_.send(socket, packet_);
  }
}

}  // namespace posed::emulate
