// The demo as a client of its own daemon: counts styled frames and compares each with the raw frame
// of the same instant.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "daemon/tools/command/degrees.hpp"
#include "daemon/tools/demo/demo_hand.hpp"
#include "models/motion/turn_sum.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/text/stream_name.hpp"

namespace posed::tools {

// Receives raw and styled frames, and compares those of the same instant.
class Watcher {
 public:
  explicit Watcher(DemoHand& hand) : hand_(hand) {}

  void take(const std::string& topic, const void* body, std::size_t size) {
    if (!frame_.ParseFromArray(body, static_cast<int>(size))) return;
    if (frame_.stream() == kDemoHandStream) return hand_.take(frame_);
    if (topic.ends_with(kRawSuffix)) {
      raw_[frame_.sequence()].assign(frame_.rotation_xyzw().begin(), frame_.rotation_xyzw().end());
      while (raw_.size() > kKept) raw_.erase(raw_.begin());
      return;
    }
    ++styled_;
    gaps_ += last_ != 0 && frame_.sequence() > last_ ? frame_.sequence() - last_ - 1 : 0;
    last_ = frame_.sequence();
    compare();
  }

  [[nodiscard]] std::uint64_t styled() const { return styled_; }
  [[nodiscard]] std::uint64_t gaps() const { return gaps_; }
  // The rms difference from the raw pose in degrees (motion::TurnSum): over all frames, and over
  // those since the last call.
  [[nodiscard]] double change_deg() const { return all_.rms_rad() * kDegrees; }
  [[nodiscard]] double change_lately_deg() {
    const double change = lately_.rms_rad() * kDegrees;
    lately_ = {};
    return change;
  }

 private:
  static Quatf rotation_at(const float* xyzw) { return {xyzw[0], xyzw[1], xyzw[2], xyzw[3]}; }

  static constexpr std::size_t kKept = 64;

  void compare() {
    const auto found = raw_.find(frame_.sequence());
    if (found == raw_.end()) return;
    const std::vector<float>& raw = found->second;
    if (static_cast<int>(raw.size()) != frame_.rotation_xyzw_size() || raw.empty()) return;
    for (std::size_t j = 0; j + 3 < raw.size(); j += 4) {
      const Quatf before = rotation_at(&raw[j]);
      const Quatf after = rotation_at(frame_.rotation_xyzw().data() + j);
      all_.add(j / 4, before, after);
      lately_.add(j / 4, before, after);
    }
    all_.end_frame();
    lately_.end_frame();
  }

  DemoHand& hand_;
  v1::Frame frame_;
  std::map<std::uint64_t, std::vector<float>> raw_;
  std::uint64_t styled_ = 0, gaps_ = 0, last_ = 0;
  motion::TurnSum all_, lately_;
};

}  // namespace posed::tools
