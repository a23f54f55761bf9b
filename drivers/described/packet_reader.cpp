#include "drivers/described/packet_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "proto/frame/degree.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::described {
namespace {

using Words = std::span<const std::string_view>;

constexpr std::size_t kMaxPackets = 16;
constexpr std::size_t kMaxMarkBytes = 16;
constexpr std::int64_t kMaxBytes = kMaxPacketBytes;
constexpr std::array<std::string_view, 2> kOrders{"little", "big"};
constexpr std::array<std::string_view, 3> kForms{"unsigned", "signed", "float"};
constexpr std::array<std::string_view, 3> kKinds{"sensor", "extra", "time"};
constexpr std::array<std::string_view, 4> kChecksums{"none", "sum8", "xor8", "crc32"};
constexpr std::array<std::string_view, 3> kSensorUnits{"1", "rad", "deg"};

constexpr std::array<std::string_view, 6> kPacketKeys{"header", "end",      "bytes",
                                                      "length", "checksum", "field"};
constexpr std::array<std::string_view, 4> kLengthKeys{"byte", "bits", "order", "add"};
constexpr std::array<std::string_view, 5> kChecksumKeys{"kind", "byte", "from", "to", "order"};
constexpr std::array<std::string_view, 14> kFieldKeys{"name",  "names", "kind",   "bit",   "byte",
                                                      "bits",  "step",  "form",   "order", "range",
                                                      "value", "scale", "offset", "unit"};
constexpr std::array<std::string_view, 15> kTimeKeys{"name",  "names", "kind",   "bit",    "byte",
                                                     "bits",  "step",  "tick_s", "form",   "order",
                                                     "range", "value", "scale",  "offset", "unit"};

bool is_name(const std::string& name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && name.size() <= 32 && letter(name[0]) &&
         std::ranges::all_of(
             name, [letter](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

}  // namespace

void PacketReader::read_packet(const toml::table& from) {
  toml_.allow(from, "a packet", kPacketKeys);
  PacketRule packet;
  packet.header = toml_.hex(from, "header", kMaxMarkBytes);
  packet.end = toml_.hex(from, "end", kMaxMarkBytes);
  read_length(from, packet);
  read_checksum(from, packet);
  const bool found = !packet.header.empty() || !table_.delimiter.empty() ||
                     packet.checksum.kind != ChecksumKind::kNone ||
                     table_.link.kind == LinkKind::kHid;
  if (!found) {
    toml_.add_error(from,
                    "nothing tells where this packet begins: give it a header or a checksum, or "
                    "the device a delimiter");
  }
  const std::size_t marks = packet.header.size() + packet.end.size() + table_.delimiter.size();
  if (marks > packet.min_bytes) {
    toml_.add_error(from, "the packet is shorter than its header and end");
  }
  if (!toml_.error()) read_fields(from, packet);
  if (table_.packets.size() == kMaxPackets)
    toml_.add_error(from, "at most 16 packets can be described");
  if (!toml_.error()) table_.packets.push_back(std::move(packet));
}

void PacketReader::read_length(const toml::table& from, PacketRule& packet) {
  const toml::table* const length = toml_.table(from, "length");
  const std::int64_t bytes = toml_.whole(from, "bytes", 0, 1, kMaxBytes);
  if (bytes == 0) {
    toml_.add_error(from,
                    "a packet needs its length: bytes = 24; with a length field in the packet, "
                    "bytes is the least that it can be");
    return;
  }
  packet.min_bytes = packet.max_bytes = static_cast<std::size_t>(bytes);
  if (length == nullptr) return;
  toml_.allow(*length, "length", kLengthKeys);
  const std::int64_t byte = toml_.whole(*length, "byte", -1, 0, kMaxBytes - 1);
  const std::int64_t bits = toml_.whole(*length, "bits", 8, 1, 16);
  if (byte < 0) toml_.add_error(*length, "length needs the byte where it stands: byte = 2");
  packet.length.fixed = false;
  packet.max_bytes = kMaxPacketBytes;
  packet.length.add = static_cast<int>(toml_.whole(*length, "add", 0, -kMaxBytes, kMaxBytes));
  const bool big = toml_.word(*length, "order", kOrders, 0) == 1;
  packet.length.place = place(*length, 8 * byte, bits, big, packet);
}

void PacketReader::read_checksum(const toml::table& from, PacketRule& packet) {
  const toml::table* const sum = toml_.table(from, "checksum");
  if (sum == nullptr) return;
  toml_.allow(*sum, "checksum", kChecksumKeys);
  ChecksumRule& rule = packet.checksum;
  rule.kind = static_cast<ChecksumKind>(toml_.word(*sum, "kind", kChecksums, 0));
  const auto at = [&](std::string_view key, std::int64_t without) {
    return static_cast<int>(toml_.whole(*sum, key, without, -kMaxBytes, kMaxBytes));
  };
  const int width = rule.kind == ChecksumKind::kCrc32 ? 4 : 1;
  rule.at = at("byte", -width);
  rule.from = at("from", 0);
  rule.to = at("to", rule.at);
  rule.big = toml_.word(*sum, "order", kOrders, 0) == 1;
  const auto length = static_cast<int>(packet.min_bytes);
  // The position must fit in the shortest packet. In a longer packet only positions counted from
  // the end move, away from the rest.
  const auto resolved = [length](int place) { return place < 0 ? length + place : place; };
  if (resolved(rule.at) < 0 || resolved(rule.at) + width > length || resolved(rule.from) < 0 ||
      resolved(rule.to) > length || resolved(rule.from) >= resolved(rule.to)) {
    toml_.add_error(*sum,
                    "the checksum or the bytes it covers (from, up to but without to) do not lie "
                    "in the packet's " +
                        std::to_string(length) + " bytes");
  }
  if (packet.length.fixed || rule.from < 0 || rule.to < 0 || toml_.error()) return;
  if (rule.from > rule.to) toml_.add_error(*sum, "from should be before to");
}

void PacketReader::read_fields(const toml::table& from, PacketRule& packet) {
  const toml::node* const fields = from.get("field");
  if (fields == nullptr) return;
  if (!fields->is_array())
    return toml_.add_error(*fields, "fields are written as [[packet.field]]");
  for (const toml::node& field : *fields->as_array()) {
    if (toml_.error()) return;
    if (!field.is_table()) return toml_.add_error(field, "fields are written as [[packet.field]]");
    read_field(*field.as_table(), packet);
  }
}

void PacketReader::read_field(const toml::table& from, PacketRule& packet) {
  Field field;
  field.kind = static_cast<FieldKind>(toml_.word(from, "kind", kKinds, 0));
  const bool time = field.kind == FieldKind::kTime;
  toml_.allow(from, "a field", time ? Words(kTimeKeys) : Words(kFieldKeys));
  field.form = static_cast<Form>(toml_.word(from, "form", kForms, 0));
  std::vector<std::string> names;
  if (const toml::array* const list = from["names"].as_array(); list != nullptr) {
    for (const toml::node& name : *list) names.push_back(name.value_or(std::string()));
  } else {
    names.push_back(toml_.text(from, "name", time ? "time" : ""));
  }
  const bool flt = field.form == Form::kFloat;
  const std::int64_t bits = toml_.whole(from, "bits", flt ? 32 : 8, 1, flt ? 64 : 32);
  if (flt && bits != 32 && bits != 64) toml_.add_error(from, "a float has 32 or 64 bits");
  if (from.contains("bit") == from.contains("byte")) {
    return toml_.add_error(from, "a field needs its place: bit = 24, or byte = 3");
  }
  std::int64_t bit = from.contains("bit") ? toml_.whole(from, "bit", 0, 0, 8 * kMaxBytes)
                                          : 8 * toml_.whole(from, "byte", 0, 0, kMaxBytes);
  const std::int64_t step = toml_.whole(from, "step", bits, 1, 8 * kMaxBytes);
  const bool big = toml_.word(from, "order", kOrders, 0) == 1;
  for (const std::string& name : names) {
    if (name != "-") {
      field.place = place(from, bit, bits, big, packet);
      read_range(from, field);
      if (toml_.error()) return;
      add_field(from, name, field, packet);
    }
    bit += step;
  }
}

void PacketReader::read_range(const toml::table& from, Field& field) {
  const double bits = field.place.bits;
  if (field.form == Form::kUnsigned) {
    field.low = 0.0;
    field.high = std::exp2(bits) - 1.0;
  } else if (field.form == Form::kSigned) {
    field.low = -std::exp2(bits - 1.0);
    field.high = std::exp2(bits - 1.0) - 1.0;
  } else {
    field.high = std::numeric_limits<float>::max();
    field.low = -field.high;
  }
  const auto range = toml_.pair(from, "range");
  if (!range) return;
  if (range->first > range->second || range->first < field.low || range->second > field.high) {
    return toml_.add_error(from,
                           "range is [least, most] of the raw value, within what its bits hold");
  }
  field.low = range->first;
  field.high = range->second;
}

void PacketReader::add_field(const toml::table& from, const std::string& name, Field field,
                             PacketRule& packet) {
  if (!is_name(name)) {
    return toml_.add_error(from,
                           "a name has up to 32 small letters, digits and _, a letter first; - "
                           "steps over a value");
  }
  if (!names_.insert(name).second)
    return toml_.add_error(from, "'" + name + "' is described twice");
  if (field.kind == FieldKind::kTime) {
    table_.tick_s = toml_.number(from, "tick_s", 0.0, 1e-9, 1.0);
    if (table_.time_bits != 0) toml_.add_error(from, "a device has one time");
    if (field.form != Form::kUnsigned || field.place.bits < 4 || table_.tick_s == 0.0) {
      toml_.add_error(from,
                      "a time is an unsigned counter of 4 bits or more, with tick_s, the seconds "
                      "of one count");
    }
    table_.time_bits = field.place.bits;
  } else if (field.kind == FieldKind::kSensor) {
    field.index = static_cast<std::uint8_t>(table_.model.sensors.size());
    add_sensor(from, name, field);
    packet.poses = true;
  } else {
    field.index = static_cast<std::uint8_t>(table_.extra_names.size());
    field.scale = toml_.number(from, "scale", 1.0, -1e9, 1e9);
    field.offset = toml_.number(from, "offset", 0.0, -1e9, 1e9);
    if (from.contains("value")) toml_.add_error(from, "value is for sensors; an extra has a scale");
    table_.extra_names.push_back(name);
    table_.extra_units.push_back(toml_.text(from, "unit", "1"));
  }
  if (2 * table_.model.sensors.size() + table_.extra_names.size() > kMaxSampleValues) {
    toml_.add_error(from, "a sample holds 64 values: two for each sensor and one for each extra");
  }
  packet.fields.push_back(field);
}

void PacketReader::add_sensor(const toml::table& from, const std::string& name,
                              const Field& field) {
  if (table_.model.sensors.size() == glove::kMaxSensors) {
    return toml_.add_error(from, "a glove has at most 32 sensors");
  }
  if (from.contains("scale") || from.contains("offset")) {
    return toml_.add_error(from,
                           "a sensor has no scale: range is its raw value, value what that means");
  }
  if (field.form == Form::kFloat && !from.contains("range")) {
    return toml_.add_error(from, "a sensor that is a float needs its range, as [0, 1]");
  }
  if (field.place.bits > 24 && !from.contains("range")) {
    return toml_.add_error(from, "a sensor of more than 24 bits needs its range, as [0, 16383]");
  }
  const auto value = toml_.pair(from, "value").value_or(std::pair(0.0, 1.0));
  const std::size_t unit = toml_.word(from, "unit", kSensorUnits, 0);
  const double factor = unit == 2 ? kDegree : 1.0;
  table_.model.sensors.push_back({.name = name,
                                  .raw_min = field.low,
                                  .raw_max = field.high,
                                  .curve = glove::Curve::line(field.low, value.first * factor,
                                                              field.high, value.second * factor),
                                  .unit = unit == 0 ? "1" : "rad"});
}

BitPlace PacketReader::place(const toml::node& blamed, std::int64_t bit, std::int64_t bits,
                             bool big, const PacketRule& packet) {
  const std::int64_t shift = bit % 8;
  const std::int64_t bytes = (shift + bits + 7) / 8;
  if (bit / 8 + bytes > static_cast<std::int64_t>(packet.min_bytes)) {
    toml_.add_error(blamed, "byte " + std::to_string(bit / 8 + bytes - 1) +
                                " is not in the packet: it has " +
                                std::to_string(packet.min_bytes) + " bytes, counted from 0");
  }
  if (bytes > 8) toml_.add_error(blamed, "a 64-bit value begins at a whole byte");
  // Little-endian: bit 0 is the lowest of the first byte. Big-endian: it is the highest.
  return {.first = static_cast<std::uint16_t>(bit / 8),
          .bytes = static_cast<std::uint8_t>(bytes),
          .shift = static_cast<std::uint8_t>(big ? 8 * bytes - shift - bits : shift),
          .bits = static_cast<std::uint8_t>(bits),
          .big = big};
}

}  // namespace posed::drivers::described
