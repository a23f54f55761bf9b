#include "drivers/natnet/protocol.hpp"

#include <array>
#include <bit>
#include <charconv>

#include "drivers/byte_reader.hpp"
#include "drivers/byte_writer.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::size_t kNameBytes = 256;
constexpr std::size_t kVersionBytes = 4;
constexpr std::string_view kClientName = "posed";
// What a server sends; a layout holds until the next one.
constexpr std::array<Version, 7> kSentVersions{
    {{2, 9}, {2, 10}, {2, 11}, {3, 0}, {3, 1}, {4, 0}, {4, 1}}};

bool is_known(std::uint16_t id) noexcept { return id <= 14 || id == 100; }

// A name in its field of 256 bytes, and two versions of four bytes each.
void write_program(ByteWriter& writer, std::string_view name, Version natnet) {
  writer.text(name);
  for (std::size_t i = name.size(); i < kNameBytes; ++i) writer.u8(0);
  writer.u32(1);  // version 1.0.0.0 of the program
  writer.u8(natnet.major);
  writer.u8(natnet.minor);
  writer.u16(0);
}

}  // namespace

std::optional<Version> read_version(std::string_view text) noexcept {
  Version version;
  const char* const end = text.data() + text.size();
  const auto [point, bad_major] = std::from_chars(text.data(), end, version.major);
  if (bad_major != std::errc() || point == end || *point != '.') return std::nullopt;
  const auto [stop, bad_minor] = std::from_chars(point + 1, end, version.minor);
  if (bad_minor != std::errc() || (stop != end && *stop != '.')) return std::nullopt;
  return version;
}

Result<Version> parse_version(std::string_view text) {
  const auto version = read_version(text);
  if (version && *version >= Version{2, 5} && version->major <= 4) return *version;
  return misuse("version should be a NatNet version from 2.5 to 4.x, like \"3.0\"");
}

RT_SAFE Outcome decode_message(std::span<const std::byte> bytes, Message& message) noexcept {
  ByteReader reader(bytes);
  const std::uint16_t id = reader.u16();
  const std::size_t length = reader.u16();
  if (!reader.ok()) return Outcome::kShort;
  if (!is_known(id)) return Outcome::kForeign;
  if (reader.left() != length) return Outcome::kShort;
  message = {.id = static_cast<MessageId>(id), .payload = reader.bytes(length)};
  return Outcome::kOk;
}

Outcome decode_request(std::span<const std::byte> bytes, Message& message) noexcept {
  ByteReader reader(bytes);
  static_cast<void>(reader.u16());
  const std::size_t length = reader.u16();
  if (!reader.ok() || reader.left() < length) return Outcome::kShort;
  return decode_message(bytes.first(bytes.size() - reader.left() + length), message);
}

RT_SAFE bool decode_server_info(std::span<const std::byte> payload, ServerInfo& info) noexcept {
  ByteReader reader(payload);
  static_cast<void>(reader.bytes(kNameBytes + kVersionBytes));
  info.version.major = reader.u8();
  info.version.minor = reader.u8();
  static_cast<void>(reader.u16());
  if (!reader.ok()) return false;
  info.clock_hz = reader.u64();
  info.data_port = reader.u16();
  info.multicast = reader.u8() != 0;
  for (int i = 0; i < 4; ++i) info.group = info.group << 8 | reader.u8();
  if (!reader.ok()) info.data_port = 0;
  return true;
}

RT_SAFE void write_description_head(const DescriptionHead& head,
                                    std::span<std::byte, kDescriptionHeadBytes> bytes) noexcept {
  const auto rate = std::bit_cast<std::array<std::byte, 4>>(head.rate_hz);
  static_assert(std::endian::native == std::endian::little);
  bytes[0] = std::byte{head.version.major};
  bytes[1] = std::byte{head.version.minor};
  bytes[2] = std::byte{head.z_up};
  bytes[3] = std::byte{0};
  for (std::size_t i = 0; i < rate.size(); ++i) bytes[4 + i] = rate[i];
}

RT_SAFE DescriptionHead read_description_head(std::span<const std::byte> bytes) noexcept {
  ByteReader reader(bytes);
  DescriptionHead head;
  head.version.major = reader.u8();
  head.version.minor = reader.u8();
  head.z_up = reader.u8() != 0;
  static_cast<void>(reader.u8());
  head.rate_hz = reader.f32();
  return head;
}

Version nearest_version(Version asked) noexcept {
  Version nearest = kSentVersions.front();
  for (const Version version : kSentVersions) {
    if (version <= asked) nearest = version;
  }
  return nearest;
}

Version version_for(std::span<const std::byte> connect) noexcept {
  constexpr std::size_t kOwn = kNameBytes + kVersionBytes, kWanted = kOwn + kVersionBytes + 1;
  for (const std::size_t at : {kWanted, kOwn}) {
    if (connect.size() < at + kVersionBytes) continue;
    const Version version{.major = std::to_integer<std::uint8_t>(connect[at]),
                          .minor = std::to_integer<std::uint8_t>(connect[at + 1])};
    if (version.known()) return nearest_version(version);
  }
  return kSentVersions.back();
}

std::vector<std::byte> encode_message(MessageId id, std::span<const std::byte> payload) {
  ByteWriter writer;
  writer.u16(static_cast<std::uint16_t>(id));
  writer.u16(static_cast<std::uint16_t>(payload.size()));
  writer.bytes(payload);
  return writer.finish();
}

std::vector<std::byte> encode_text(MessageId id, std::string_view text) {
  ByteWriter writer;
  writer.text(text);
  writer.u8(0);
  return encode_message(id, writer.finish());
}

// The version is what the vendor's own client of the recording sent.
std::vector<std::byte> encode_connect() {
  ByteWriter writer;
  write_program(writer, kClientName, {3, 0});
  return encode_message(MessageId::kConnect, writer.finish());
}

std::vector<std::byte> encode_server_info(const ServerInfo& info) {
  ByteWriter writer;
  write_program(writer, info.name, info.version);
  if (info.version >= Version{3, 0}) {
    writer.u64(info.clock_hz);
    writer.u16(info.data_port);
    writer.u8(info.multicast ? 1 : 0);
    for (const int shift : {24, 16, 8, 0}) {
      writer.u8(static_cast<std::uint8_t>(info.group >> shift & 0xFFU));
    }
  }
  return encode_message(MessageId::kServerInfo, writer.finish());
}

}  // namespace posed::drivers::natnet
