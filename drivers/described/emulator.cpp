#include "drivers/described/emulator.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/described/protocol.hpp"

namespace posed::drivers::described {
namespace {

constexpr double kDefaultRate_hz = 100.0;
constexpr std::size_t kMaxReceived = 256;  // longer than any command

std::int64_t period_ns(const Table& table) {
  return std::llround(1e9 / (table.rate_hz > 0.0 ? table.rate_hz : kDefaultRate_hz));
}

}  // namespace

DescribedEmulator::DescribedEmulator(std::shared_ptr<const Table> table,
                                     std::shared_ptr<const glove::Calibration> calibration)
    : table_(std::move(table)), calibration_(std::move(calibration)), pace_(period_ns(*table_)) {
  pose_hand({});
  if (table_->link.start.empty()) pace_.start(0);
}

void DescribedEmulator::pose_hand(const HandAngles& angles) {
  for (std::size_t s = 0; s < calibration_->sensors; ++s) {
    raw_[s] = glove::raw_of_pose(*calibration_, s, angles).value_or(raw_[s]);
  }
}

void DescribedEmulator::receive(std::span<const std::byte> bytes, std::int64_t now_ns,
                                Bytes& /*answer*/) {
  for (const std::byte byte : bytes) {
    if (received_.size() == kMaxReceived)
      received_.erase(received_.begin(), received_.begin() + kMaxReceived / 2);
    received_.push_back(byte);
    if (has_received(table_->link.stop)) pace_.stop();
    if (has_received(table_->link.start) && !pace_.running()) pace_.start(now_ns);
  }
}

bool DescribedEmulator::has_received(const std::vector<std::byte>& command) const {
  return !command.empty() && received_.size() >= command.size() &&
         std::ranges::equal(command, std::span(received_).last(command.size()));
}

void DescribedEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (!pace_.running()) return;
  // Packets without a pose first, so that their values go with the pose.
  for (const bool poses : {false, true}) {
    for (const PacketRule& rule : table_->packets) {
      if (!rule.fields.empty() && rule.poses == poses) add_packet(rule, out);
    }
  }
  const std::int64_t before_ns = pace_.due_ns();
  pace_.step(now_ns);
  clock_ns_ += pace_.due_ns() - before_ns;
}

void DescribedEmulator::add_packet(const PacketRule& rule, Bytes& out) const {
  std::vector<std::byte> packet = blank_packet(*table_, rule);
  for (const Field& field : rule.fields) write_field(field, value_of(field), packet);
  write_checksum(rule, packet);
  if (rule.columns > 0) {
    const auto columns = packet.begin() + static_cast<std::ptrdiff_t>(rule.header.size());
    packet.erase(std::remove(columns, packet.end(), std::byte{' '}), packet.end());
  }
  out.insert(out.end(), packet.begin(), packet.end());
}

double DescribedEmulator::value_of(const Field& field) const {
  if (field.kind == FieldKind::kSensor) return raw_[field.index];
  if (field.kind == FieldKind::kExtra) return (extra_[field.index] - field.offset) / field.scale;
  const std::uint64_t mask = (std::uint64_t{1} << table_->time_bits) - 1;
  const double ticks = std::round(static_cast<double>(clock_ns_) * 1e-9 / table_->tick_s);
  return static_cast<double>(static_cast<std::uint64_t>(ticks) & mask);
}

void DescribedEmulator::set_ticks(std::uint64_t ticks) {
  clock_ns_ = std::llround(static_cast<double>(ticks) * table_->tick_s * 1e9);
}

}  // namespace posed::drivers::described
