// Emulates a hand tracker: both hands before a camera, palms towards it, which open and close.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/emulate/pace.hpp"
#include "drivers/emulator.hpp"
#include "drivers/landmarks/protocol.hpp"

namespace posed::drivers::landmarks {

class LandmarksEmulator final : public Emulator {
 public:
  explicit LandmarksEmulator(double rate_hz);

  [[nodiscard]] const Skeleton* skeleton(std::size_t body) const override {
    return body < hands_.size() ? hands_[body].skeleton.get() : nullptr;
  }
  void pose(std::size_t body, const Frame& frame) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

  // Whether the tracker sees this hand.
  void set_seen(std::size_t body, bool seen) { hands_[body].seen = seen; }

 private:
  struct Hand {
    std::shared_ptr<const Skeleton> skeleton;
    Frame frame;
    bool posed = false;
    bool seen = true;
  };
  std::array<Hand, kMaxHands> hands_;  // left, right
  emulate::Pace pace_;
};

}  // namespace posed::drivers::landmarks
