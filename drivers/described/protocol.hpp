// Converts between bytes and values of a table-driven device, using its Table. Pure; no I/O.
//
//   offset 0      header.size()                                 length
//   +------------+---------- ... ----------+----------+-------+
//   |  header    |  fields, at their bits  | checksum |  end  |
//   +------------+---------- ... ----------+----------+-------+
//
// Or a line of text: a prefix, and columns of numbers, which the table's delimiter ends.
//
// Each part may be missing, but something must mark where a packet begins. The checksum may be at
// any position; the length is fixed or read from a field.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/described/table.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::described {

// The result of a look at the start of `bytes`.
struct Look {
  enum class Found : std::uint8_t { kNothing, kMayCome, kPacket };
  Found found = Found::kNothing;
  Outcome why = Outcome::kForeign;  // for kNothing: how far the bytes resembled a packet
  const PacketRule* rule = nullptr;
  std::size_t bytes = 0;  // for kPacket: its length
};

// kMayCome: the bytes could be the beginning of a packet that is not complete yet.
RT_SAFE [[nodiscard]] Look look_for_packet(const Table& table,
                                           std::span<const std::byte> bytes) noexcept;

// The raw value of a field in a complete packet.
RT_SAFE [[nodiscard]] double read_field(const Field& field,
                                        std::span<const std::byte> packet) noexcept;
[[nodiscard]] std::uint64_t read_bits(const BitPlace& place,
                                      std::span<const std::byte> packet) noexcept;

// The inverse: `raw` is rounded to the field's bits and limited to its range.
void write_field(const Field& field, double raw, std::span<std::byte> packet) noexcept;

// The shortest packet of this rule: zeros, with its header, length, end and delimiter. Columns of a
// line have room for any number, as blanks.
[[nodiscard]] std::vector<std::byte> blank_packet(const Table& table, const PacketRule& rule);
// Writes the checksum; call it after all fields are written.
void write_checksum(const PacketRule& rule, std::span<std::byte> packet) noexcept;

}  // namespace posed::drivers::described
