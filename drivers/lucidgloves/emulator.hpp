// Emulates a LucidGlove: streams from power-on, sends its info when asked, and accepts force
// feedback and vibration.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/emulate/pace.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/lucidgloves/decoder.hpp"

namespace posed::drivers::lucidgloves {

class LucidEmulator final : public glove::GloveEmulator {
 public:
  // kAuto sends the alpha encoding.
  explicit LucidEmulator(const Settings& settings);

  void pose_hand(const HandAngles& angles) override;
  // Commands end with a line end: (ZA) starts and (ZZ) stops the stream, Z asks for the info, F...
  // is a vibration, and other letters are forces (protocol.hpp).
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

  // How strongly each finger's motor blocks it, as last received, and the last vibration line.
  [[nodiscard]] const Forces& forces() const { return forces_; }
  [[nodiscard]] const std::string& vibration() const { return vibration_; }

 private:
  void obey(const std::string& command, std::int64_t now_ns, Bytes& answer);

  Settings settings_;
  emulate::Pace pace_;
  Line line_;
  Forces forces_{};
  std::string vibration_;
  std::string command_;  // received so far
};

}  // namespace posed::drivers::lucidgloves
