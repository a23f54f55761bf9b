// Emulates any table-driven device: sends each of its packets that has fields, at the rate in its
// description or else at 100 Hz. It begins when it receives its start bytes (at power-on if there
// are none) and ends when it receives its stop bytes.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "drivers/described/table.hpp"
#include "drivers/emulate/pace.hpp"
#include "drivers/glove/calibration.hpp"
#include "drivers/glove/glove_emulator.hpp"

namespace posed::drivers::described {

class DescribedEmulator final : public glove::GloveEmulator {
 public:
  DescribedEmulator(std::shared_ptr<const Table> table,
                    std::shared_ptr<const glove::Calibration> calibration);

  // Sets each sensor from the pose, by its first entry in the angle map; one without keeps its
  // value.
  void pose_hand(const HandAngles& angles) override;
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override;
  [[nodiscard]] std::int64_t next_due_ns() const override { return pace_.due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override;

  // Sets the content of the next packets: raw values of sensors, values of extras in their units.
  // An index beyond the arrays throws.
  void set_sensor(std::size_t sensor, double raw) { raw_.at(sensor) = raw; }
  void set_extra(std::size_t extra, double value) { extra_.at(extra) = value; }
  // Sets the device's clock, in Table::tick_s.
  void set_ticks(std::uint64_t ticks);

 private:
  void add_packet(const PacketRule& rule, Bytes& out) const;
  [[nodiscard]] double value_of(const Field& field) const;
  // True when `received_` ends with these bytes.
  [[nodiscard]] bool has_received(const std::vector<std::byte>& command) const;

  std::shared_ptr<const Table> table_;
  std::shared_ptr<const glove::Calibration> calibration_;
  std::array<double, glove::kMaxSensors> raw_{};
  std::array<double, kMaxExtras> extra_{};
  std::vector<std::byte> received_;
  emulate::Pace pace_;
  std::int64_t clock_ns_ = 0;  // the device's own time
};

}  // namespace posed::drivers::described
