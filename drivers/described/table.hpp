// Table: a device description (a TOML file, device_file.hpp) compiled for decoding. Everything in
// it has been checked: packets have a length, fields lie inside their packets, names are unique,
// counts fit a Sample. Const after that.
//
// Positions in a packet count from its first byte; a negative one counts from its end (-1 is the
// last byte), so that packets of variable length can have their checksum at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/glove/model.hpp"

namespace posed::drivers::described {

inline constexpr std::size_t kMaxPacketBytes = 1024;
inline constexpr std::size_t kMaxExtras = 64;
inline constexpr std::size_t kMaxFields = glove::kMaxSensors + kMaxExtras + 1;  // and the time

enum class LinkKind : std::uint8_t { kSerial, kTcp, kHid };

struct LinkRule {
  LinkKind kind = LinkKind::kSerial;
  int baud = 115200;                   // serial
  std::vector<std::uint32_t> usb_ids;  // vendor << 16 | product; serial: of the USB converter
  std::string listen = "127.0.0.1:0";  // tcp: address that the glove connects to
  std::vector<std::byte> start, stop;  // sent when the link opens; `stop` first, for a clean start
};

// Location of a field's bits in a packet, prepared for a single read: `bytes` bytes from `first`,
// combined in their order, shifted right and masked. In a line of text `first` is the column and
// `bytes` the length of the prefix before the columns.
struct BitPlace {
  std::uint16_t first = 0;
  std::uint8_t bytes = 1;
  std::uint8_t shift = 0;
  std::uint8_t bits = 8;
  bool big = false;  // most significant byte first; bits count from the top of a byte
};

enum class Form : std::uint8_t { kUnsigned, kSigned, kFloat, kText };
enum class FieldKind : std::uint8_t { kSensor, kExtra, kTime };

struct Field {
  FieldKind kind = FieldKind::kSensor;
  Form form = Form::kUnsigned;
  BitPlace place;
  std::uint8_t index = 0;            // index among the sensors or the extras
  double low = 0.0, high = 0.0;      // raw values outside this range reject the packet
  double scale = 1.0, offset = 0.0;  // for an extra: raw * scale + offset, in its unit
};

enum class ChecksumKind : std::uint8_t { kNone, kSum8, kXor8, kCrc32 };

struct ChecksumRule {
  ChecksumKind kind = ChecksumKind::kNone;
  int at = 0;            // position of its first byte
  int from = 0, to = 0;  // covers the bytes from `from` up to but not including `to`
  bool big = false;      // byte order of a CRC-32
};

// A length field in the packet: whole length in bytes = field + add.
struct LengthRule {
  bool fixed = true;
  BitPlace place;
  int add = 0;
};

struct PacketRule {
  std::vector<std::byte> header;  // the first bytes of the packet; may be empty
  std::vector<std::byte> end;     // the last bytes of the packet
  std::size_t min_bytes = 0, max_bytes = 0;
  std::size_t columns = 0;  // of a line of text, which the delimiter ends; 0: a packet of bytes
  LengthRule length;
  ChecksumRule checksum;
  std::vector<Field> fields;  // empty: a known packet that is skipped
  bool poses = false;         // contains a sensor, so the packet produces a Sample and a Frame
};

struct Table {
  std::string name, summary;
  double rate_hz = 0.0;
  LinkRule link;
  std::vector<std::byte> delimiter;  // ends every packet and occurs in none; empty: none
  std::vector<PacketRule> packets;
  glove::Model model;  // its sensors, and the whole TOML text for the angle map
  std::vector<std::string> extra_names, extra_units;
  int time_bits = 0;  // 0: the device has no time of its own
  double tick_s = 0.0;
};

}  // namespace posed::drivers::described
