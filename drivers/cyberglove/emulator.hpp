// Emulates a CyberGlove's box as described in its manuals and drivers: commands and state of a I or
// II (8-bit) and, with level-one commands, of a III (16-bit records). The README lists what is
// inferred.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/cyberglove/protocol.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::cyberglove {

struct EmulatorSettings {
  Side hand = Side::kRight;
  std::uint32_t mask = kMask22;  // fitted sensors
  bool level_one = false;        // a III: "1.." commands and 16-bit records
  std::string info = "CyberGlove II, Version 2.1";
  std::uint32_t first_count = 0;     // of the time stamp
  std::int64_t first_sub_frame = 0;  // sub-frames since midnight, at the III's multiplier
  // Faults; they may be changed while the emulator runs.
  bool plugged_in = true;
  bool too_fast = false;    // an error pair in every sample
  bool stray_echo = false;  // "e1S" before each 16-bit record
  int stuck_sensor = -1;    // mask bit
  std::uint8_t stuck_at = 128;
};

class CyberGloveEmulator final : public glove::GloveEmulator {
 public:
  static Result<std::unique_ptr<CyberGloveEmulator>> make(EmulatorSettings settings);

  void pose_hand(const HandAngles& angles) override;
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override;
  void emit(std::int64_t now_ns, Bytes& out) override;

  // Sets the sensor readings [8-bit counts] directly instead of from a pose.
  void set_raw(const std::array<double, kSensors>& raw) { raw_ = raw; }
  [[nodiscard]] EmulatorSettings& settings() { return settings_; }

 private:
  enum class Streaming : std::uint8_t { kNo, k8Bit, kAscii, k16Bit };
  using Values = std::vector<unsigned>;

  CyberGloveEmulator(EmulatorSettings settings, glove::Model model,
                     std::shared_ptr<const glove::Calibration> calibration);

  static void add(std::string_view text, Bytes& out);
  void power_up();
  // Length of the command at the start of `input`; 0 when it is incomplete.
  [[nodiscard]] std::size_t handle_command(std::string_view input, Bytes& answer);
  [[nodiscard]] std::size_t handle_query(std::string_view input, Bytes& answer) const;
  [[nodiscard]] std::size_t handle_binary_set(std::string_view input, Bytes& answer);
  [[nodiscard]] std::size_t handle_ascii_set(std::string_view input, Bytes& answer);
  [[nodiscard]] std::size_t handle_level_one(std::string_view input, Bytes& answer);
  [[nodiscard]] std::size_t handle_touch(std::string_view input, Bytes& answer);
  [[nodiscard]] std::optional<Values> state_of(char letter) const;
  [[nodiscard]] bool set_state(char letter, const Values& values);
  [[nodiscard]] std::array<unsigned, 3> parameter_flags() const;

  void start(Streaming what);
  [[nodiscard]] std::int64_t due_after_start_ns(std::int64_t records) const;
  [[nodiscard]] Values sample_values() const;
  void add_sample(std::byte first, std::int64_t at_ns, Bytes& out) const;
  void add_ascii_sample(char first, Bytes& out) const;
  void add_record(Bytes& out);

  EmulatorSettings settings_;
  glove::Model model_;
  std::shared_ptr<const glove::Calibration> calibration_;
  std::array<double, kSensors> raw_{};
  std::string input_;
  std::map<char, unsigned> flags_;  // settings of one byte: B D F J L N Q U W Y
  std::uint32_t mask_ = 0;
  Period period_;
  std::array<unsigned, 6> touch_{};
  unsigned multiplier_ = 1, divider_ = 1;
  Streaming streaming_ = Streaming::kNo;
  std::int64_t now_ns_ = 0, start_ns_ = 0;
  std::optional<std::int64_t> power_up_ns_;
  std::int64_t records_ = 0;  // since the start of streaming
  std::int64_t sub_frame_ = 0;
};

}  // namespace posed::drivers::cyberglove
