#include "drivers/described/protocol.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "proto/text/number.hpp"

namespace posed::drivers::described {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::uint64_t mask_of(int bits) noexcept {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

// Loads the bytes of a BitPlace as one number, in their order; higher bits may hold following
// bytes.
std::uint64_t gather(const BitPlace& place, std::span<const std::byte> packet) noexcept {
  const auto behind = packet.subspan(place.first);
  std::uint64_t all = 0;  // the host is little-endian
  if (behind.size() >= sizeof all) {
    // A single load; copying a variable number of bytes would be a call.
    std::memcpy(&all, behind.data(), sizeof all);
  } else {
    std::memcpy(&all, behind.data(), behind.size());
  }
  return place.big ? std::byteswap(all) >> (64 - 8 * place.bytes) : all;
}

void scatter(const BitPlace& place, std::uint64_t all, std::span<std::byte> packet) noexcept {
  for (std::size_t i = 0; i < place.bytes; ++i) {
    const std::size_t at = place.big ? place.bytes - 1U - i : i;
    packet[place.first + at] = static_cast<std::byte>(all >> (8 * i) & 0xFF);
  }
}

void write_bits(const BitPlace& place, std::uint64_t value, std::span<std::byte> packet) noexcept {
  const std::uint64_t mask = mask_of(place.bits) << place.shift;
  scatter(place, (gather(place, packet) & ~mask) | (value << place.shift & mask), packet);
}

std::size_t from_start(int place, std::size_t length) noexcept {
  return static_cast<std::size_t>(place < 0 ? static_cast<int>(length) + place : place);
}

std::span<const std::byte> summed(const ChecksumRule& rule,
                                  std::span<const std::byte> packet) noexcept {
  const std::size_t from = from_start(rule.from, packet.size());
  return packet.subspan(from, from_start(rule.to, packet.size()) - from);
}

std::uint32_t checksum(const ChecksumRule& rule, std::span<const std::byte> packet) noexcept {
  const auto bytes = summed(rule, packet);
  if (rule.kind == ChecksumKind::kCrc32) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  }
  std::uint32_t sum = 0;
  for (const std::byte byte : bytes) {
    const auto value = std::to_integer<std::uint32_t>(byte);
    sum = rule.kind == ChecksumKind::kSum8 ? sum + value : sum ^ value;
  }
  return sum & 0xFF;
}

BitPlace checksum_place(const ChecksumRule& rule, std::size_t length) noexcept {
  const bool crc = rule.kind == ChecksumKind::kCrc32;
  return {.first = static_cast<std::uint16_t>(from_start(rule.at, length)),
          .bytes = static_cast<std::uint8_t>(crc ? 4 : 1),
          .bits = static_cast<std::uint8_t>(crc ? 32 : 8),
          .big = rule.big};
}

bool starts_alike(std::span<const std::byte> bytes, std::span<const std::byte> header) noexcept {
  const std::size_t count = std::min(bytes.size(), header.size());
  return std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count),
                    header.begin());
}

bool ends_in(std::span<const std::byte> bytes, std::span<const std::byte> end) noexcept {
  return std::ranges::equal(bytes.last(end.size()), end);
}

// A line has numbers with , ; a tab or blanks between them.
constexpr int kColumnChars = 24;  // of a value that is written; the blanks after it are left out

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string_view without_blanks(std::string_view text) noexcept {
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
}

// Takes the next column off the text, which begins with no blank.
std::string_view next_column(std::string_view& text) noexcept {
  const std::size_t end = std::min(text.find_first_of(",; \t"), text.size());
  const std::string_view column = text.substr(0, end);
  text.remove_prefix(end);
  const auto skip_blanks = [&text] {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  };
  skip_blanks();
  if (!text.empty() && (text[0] == ',' || text[0] == ';' || text[0] == '\t')) {
    text.remove_prefix(1);
    skip_blanks();
  }
  return column;
}

std::string_view column_at(const BitPlace& place, std::span<const std::byte> packet) noexcept {
  std::string_view text = without_blanks(text_of(packet.subspan(place.bytes)));
  for (std::size_t i = 0; i < place.first; ++i) static_cast<void>(next_column(text));
  return next_column(text);
}

// NaN where the column is no number.
double read_text(const BitPlace& place, std::span<const std::byte> packet) noexcept {
  return exact_number<double>(column_at(place, packet))
      .value_or(std::numeric_limits<double>::quiet_NaN());
}

Look look_for_line(const Table& table, const PacketRule& rule,
                   std::span<const std::byte> bytes) noexcept {
  Look look{.found = Look::Found::kMayCome, .rule = &rule};
  const auto& mark = table.delimiter;
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(rule.header.size());
  const auto end = std::search(begin, bytes.end(), mark.begin(), mark.end());
  if (end == bytes.end()) return look;
  look.bytes = static_cast<std::size_t>(end - bytes.begin()) + mark.size();
  std::string_view text = without_blanks(text_of(std::span(begin, end)));
  std::size_t columns = 0;
  for (; !text.empty(); ++columns) static_cast<void>(next_column(text));
  look.found = columns == rule.columns ? Look::Found::kPacket : Look::Found::kNothing;
  look.why = Outcome::kShort;
  return look;
}

// Length of a packet of this rule; 0 when it is not known yet, more than kMaxPacketBytes when it is
// invalid.
std::size_t length_of(const PacketRule& rule, std::span<const std::byte> bytes) noexcept {
  if (rule.length.fixed) return rule.max_bytes;
  const BitPlace& place = rule.length.place;
  if (bytes.size() < std::size_t{place.first} + place.bytes) return 0;
  const auto length = static_cast<std::int64_t>(read_bits(place, bytes)) + rule.length.add;
  const bool valid = length >= static_cast<std::int64_t>(rule.min_bytes) &&
                     length <= static_cast<std::int64_t>(rule.max_bytes);
  return valid ? static_cast<std::size_t>(length) : kMaxPacketBytes + 1;
}

Look look_for(const Table& table, const PacketRule& rule,
              std::span<const std::byte> bytes) noexcept {
  Look look{.rule = &rule};
  if (!starts_alike(bytes, rule.header)) return look;
  look.found = Look::Found::kMayCome;
  if (bytes.size() < rule.header.size()) return look;
  if (rule.columns > 0) return look_for_line(table, rule, bytes);
  look.bytes = length_of(rule, bytes);
  if (look.bytes <= kMaxPacketBytes && (look.bytes == 0 || bytes.size() < look.bytes)) return look;
  look.found = Look::Found::kNothing;
  look.why = Outcome::kShort;
  if (look.bytes > kMaxPacketBytes) return look;
  const auto packet = bytes.first(look.bytes);
  if (!ends_in(packet, rule.end) || !ends_in(packet, table.delimiter)) return look;
  look.why = Outcome::kBadChecksum;
  if (rule.checksum.kind != ChecksumKind::kNone &&
      read_bits(checksum_place(rule.checksum, packet.size()), packet) !=
          checksum(rule.checksum, packet)) {
    return look;
  }
  look.found = Look::Found::kPacket;
  return look;
}

}  // namespace

RT_SAFE Look look_for_packet(const Table& table, std::span<const std::byte> bytes) noexcept {
  Look best;
  for (const PacketRule& rule : table.packets) {
    const Look look = look_for(table, rule, bytes);
    if (look.found > best.found || (look.found == best.found && best.why == Outcome::kForeign)) {
      best = look;
    }
    if (best.found == Look::Found::kPacket) break;
  }
  return best;
}

RT_SAFE std::uint64_t read_bits(const BitPlace& place, std::span<const std::byte> packet) noexcept {
  return gather(place, packet) >> place.shift & mask_of(place.bits);
}

RT_SAFE double read_field(const Field& field, std::span<const std::byte> packet) noexcept {
  if (field.form == Form::kText) return read_text(field.place, packet);
  const std::uint64_t bits = read_bits(field.place, packet);
  if (field.form == Form::kUnsigned) return static_cast<double>(bits);
  if (field.form == Form::kSigned) {
    const std::uint64_t sign = std::uint64_t{1} << (field.place.bits - 1);
    return static_cast<double>(static_cast<std::int64_t>((bits ^ sign) - sign));
  }
  if (field.place.bits == 64) return std::bit_cast<double>(bits);
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
}

void write_field(const Field& field, double raw, std::span<std::byte> packet) noexcept {
  const double value = std::clamp(std::isfinite(raw) ? raw : field.low, field.low, field.high);
  if (field.form == Form::kText) {
    const std::string_view column = column_at(field.place, packet);
    auto* const at =
        reinterpret_cast<char*>(packet.data()) + (column.data() - text_of(packet).data());
    std::fill_n(at, kColumnChars, ' ');
    // The shortest text of a double has 24 characters at most; that of a whole number has no "e".
    if (value == std::floor(value) && std::abs(value) < 1e15) {
      std::to_chars(at, at + kColumnChars, static_cast<std::int64_t>(value));
    } else {
      std::to_chars(at, at + kColumnChars, value);
    }
    return;
  }
  std::uint64_t bits = 0;
  if (field.form != Form::kFloat) {
    bits = static_cast<std::uint64_t>(std::llround(value));
  } else if (field.place.bits == 64) {
    bits = std::bit_cast<std::uint64_t>(value);
  } else {
    bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  }
  write_bits(field.place, bits, packet);
}

std::vector<std::byte> blank_packet(const Table& table, const PacketRule& rule) {
  std::vector<std::byte> packet(rule.min_bytes);
  if (rule.columns > 0) {
    std::string line(text_of(rule.header));
    for (std::size_t i = 0; i < rule.columns; ++i) {
      line += (i > 0 ? "," : "") + std::string("0") + std::string(kColumnChars - 1, ' ');
    }
    const auto bytes = std::as_bytes(std::span(line));
    packet.assign(bytes.begin(), bytes.end());
    packet.insert(packet.end(), table.delimiter.begin(), table.delimiter.end());
    return packet;
  }
  std::ranges::copy(rule.header, packet.begin());
  const auto put_last = [&packet](const std::vector<std::byte>& bytes) {
    std::ranges::copy(bytes, packet.end() - static_cast<std::ptrdiff_t>(bytes.size()));
  };
  put_last(rule.end);
  put_last(table.delimiter);
  if (!rule.length.fixed) {
    write_bits(rule.length.place,
               static_cast<std::uint64_t>(static_cast<int>(packet.size()) - rule.length.add),
               packet);
  }
  return packet;
}

void write_checksum(const PacketRule& rule, std::span<std::byte> packet) noexcept {
  if (rule.checksum.kind == ChecksumKind::kNone) return;
  write_bits(checksum_place(rule.checksum, packet.size()), checksum(rule.checksum, packet), packet);
}

}  // namespace posed::drivers::described
