// Emulates a 5DT glove of any form.
#pragma once

#include "drivers/emulate/pace.hpp"
#include "drivers/fivedt/decoder.hpp"
#include "drivers/glove/glove_emulator.hpp"

namespace posed::drivers::fivedt {

class FiveDtEmulator final : public glove::GloveEmulator {
 public:
  // A Data Glove 5 sends nothing until it receives D or C; all others stream at once.
  explicit FiveDtEmulator(const Settings& settings);

  void pose_hand(const HandAngles& angles) override;
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

 private:
  void send(const Reading& reading, Bytes& out) const;

  Settings settings_;
  emulate::Pace pace_;
  Reading reading_;
  int records_ = 0;
};

}  // namespace posed::drivers::fivedt
