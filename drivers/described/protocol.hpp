// Bytes and values of a described device, both ways, by its Table. Pure; no I/O.
//
//   offset 0      header.size()                                 length
//   +------------+---------- ... ----------+----------+-------+
//   |  header    |  fields, at their bits  | checksum |  end  |
//   +------------+---------- ... ----------+----------+-------+
//
// Each part may be missing, but something has to tell where a packet begins. The checksum may stand
// anywhere; the length is fixed or read from a field.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/described/table.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::described {

// What stands at the beginning of `bytes`.
struct Look {
  enum class Found : std::uint8_t { kNothing, kMayCome, kPacket };
  Found found = Found::kNothing;
  Outcome why = Outcome::kForeign;  // of kNothing: how near it was to a packet
  const PacketRule* rule = nullptr;
  std::size_t bytes = 0;  // of kPacket
};

// kMayCome: what is there agrees with a packet that is not whole yet. RT-safe.
[[nodiscard]] Look look_for_packet(const Table& table, std::span<const std::byte> bytes) noexcept;

// The raw value in these bits of a whole packet. RT-safe.
[[nodiscard]] double read_field(const Field& field, std::span<const std::byte> packet) noexcept;
[[nodiscard]] std::uint64_t read_bits(const BitPlace& place,
                                      std::span<const std::byte> packet) noexcept;

// The other way: the value is rounded to what the bits hold and cut to the field's range.
void write_field(const Field& field, double raw, std::span<std::byte> packet) noexcept;

// Zeros, and the header, length, end and delimiter of the shortest packet of this rule.
[[nodiscard]] std::vector<std::byte> blank_packet(const Table& table, const PacketRule& rule);
// Fills in the checksum; last, when the fields are written.
void seal_packet(const PacketRule& rule, std::span<std::byte> packet) noexcept;

}  // namespace posed::drivers::described
