// Emulates a P5: its input reports and its answers to feature requests.
#pragma once

#include "drivers/emulate/pace.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/p5/camera_rig.hpp"

namespace posed::drivers::p5 {

// Feature reports of an emulated P5: head tilts as in libp5glove, LED positions invented for posed.
[[nodiscard]] std::array<std::byte, kHeadsBytes> emulated_heads();
[[nodiscard]] std::array<std::byte, kFirmwareBytes> emulated_firmware();
[[nodiscard]] std::array<std::byte, kLedsBytes> emulated_leds();

class P5Emulator final : public glove::GloveEmulator {
 public:
  P5Emulator();

  // The hand keeps still half a metre in front of the rig; four of its LEDs are seen.
  void pose_hand(const HandAngles& angles) override;
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

 private:
  emulate::Pace pace_;
  Report report_;
};

}  // namespace posed::drivers::p5
