#include "drivers/described/device_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <utility>

#include "drivers/glove/angle_map.hpp"
#include "proto/frame/config_texts.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/toml.hpp"
#include "proto/text/toml_table.hpp"

namespace posed::drivers::described {
namespace {

constexpr std::string_view kWhat = "device description";
constexpr std::array<std::string_view, 3> kLinks{"serial", "tcp", "hid"};
constexpr std::size_t kMaxPackets = 16;
constexpr std::size_t kMaxCommand = 64;
constexpr std::size_t kMaxDelimiter = 4;
constexpr std::size_t kMaxUsbIds = 16;
constexpr Range kUsbNumbers{0, 0xFFFF};
constexpr Range kBauds{1, 4'000'000};
constexpr Range kRates_hz{0.0, 1000.0};

void read_usb_ids(TableReader& link, LinkRule& rule) {
  int vendor = 0;
  int product = 0;
  link.read("usb_ids", rule.usb_ids);
  link.read("vendor", vendor, kUsbNumbers);
  link.read("product", product, kUsbNumbers);
  if (link.has("vendor") != link.has("product") || rule.usb_ids.size() > kMaxUsbIds) {
    link.add_error(link.has("product") ? "product" : "vendor",
                   "USB ids are written as vendor = 0x1234 and product = 0x5678, or for a serial "
                   "port as usb_ids = [0x12345678]: vendor and product in one number");
  }
  if (!link.has("vendor")) return;
  const auto id = static_cast<std::uint32_t>(vendor) << 16 | static_cast<std::uint32_t>(product);
  rule.usb_ids.insert(rule.usb_ids.begin(), id);
}

void read_link(TableReader& device, LinkRule& rule) {
  auto link = device.table("link");
  if (!link) return;
  rule.kind = static_cast<LinkKind>(link->choice("kind", kLinks));
  link->read("baud", rule.baud, kBauds);
  link->read("listen", rule.listen);
  rule.start = link->hex("start", kMaxCommand);
  rule.stop = link->hex("stop", kMaxCommand);
  read_usb_ids(*link, rule);
  link->finish();
  const bool hid = rule.kind == LinkKind::kHid;
  if (hid && (!link->has("vendor") || link->has("usb_ids"))) {
    link->add_error("kind", "a HID device is found by vendor = 0x1234 and product = 0x5678");
  }
}

// Reads the [[packet]] tables of a device description into a Table.
class PacketReader {
 public:
  // Adds to `table`, whose link and delimiter have been read already. After an error it may leave
  // the rest of a packet unread: only one is reported.
  PacketReader(Findings& findings, Table& table) : findings_(findings), table_(table) {}

  void read_packet(TableReader& from);

 private:
  // One [[packet.field]]: one value, or several consecutive ones of one kind.
  struct FieldGroup {
    Field field;                            // without its place and index
    std::array<double, 2> value{0.0, 1.0};  // of a sensor, at the ends of its range
    std::string unit = "1";                 // of a sensor or an extra
    double tick_s = 0.0;                    // of a time
  };

  void read_line(TableReader& from);
  void read_length(TableReader& from, PacketRule& packet);
  void read_checksum(TableReader& from, PacketRule& packet);
  void read_field(TableReader& from, PacketRule& packet);
  bool read_first_bit(TableReader& from, int& bit, int& step);
  void read_range(TableReader& from, int bits, Field& field);
  void read_meaning(TableReader& from, FieldGroup& group);
  void add_field(TableReader& from, const std::string& name, FieldGroup group, PacketRule& packet);
  void add_sensor(TableReader& from, const std::string& name, const FieldGroup& group);
  [[nodiscard]] BitPlace place(TableReader& from, int bit, int bits, bool big,
                               const PacketRule& packet);
  [[nodiscard]] BitPlace column(TableReader& from, int column, int bits, const PacketRule& packet);
  [[nodiscard]] bool good() const { return findings_.errors.empty(); }

  Findings& findings_;
  Table& table_;
  std::set<std::string> names_;
};

constexpr std::size_t kMaxMarkBytes = 16;
constexpr int kMaxBytes = kMaxPacketBytes;
constexpr int kMaxColumns = 256;
constexpr Range kPlaces{-kMaxBytes, kMaxBytes};  // in a packet, or counted from its end
constexpr Range kRawValues{-1e12, 1e12};
constexpr Range kScales{-1e9, 1e9};
constexpr std::array<std::string_view, 2> kOrders{"little", "big"};
constexpr std::array<std::string_view, 3> kForms{"unsigned", "signed", "float"};
constexpr std::array<std::string_view, 3> kKinds{"sensor", "extra", "time"};
constexpr std::array<std::string_view, 4> kChecksums{"none", "sum8", "xor8", "crc32"};
constexpr std::array<std::string_view, 3> kSensorUnits{"1", "rad", "deg"};

bool is_name(const std::string& name) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && name.size() <= 32 && letter(name[0]) &&
         std::ranges::all_of(
             name, [letter](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

void PacketReader::read_packet(TableReader& from) {
  const bool is_line = from.has("columns");
  if (!table_.packets.empty() && is_line != (table_.packets.front().columns > 0)) {
    return from.add_error("columns", "a device sends lines of text or packets of bytes, not both");
  }
  if (is_line) return read_line(from);
  PacketRule packet;
  packet.header = from.hex("header", kMaxMarkBytes);
  packet.end = from.hex("end", kMaxMarkBytes);
  read_length(from, packet);
  if (good()) read_checksum(from, packet);
  if (!good()) return;
  const bool found = !packet.header.empty() || !table_.delimiter.empty() ||
                     packet.checksum.kind != ChecksumKind::kNone ||
                     table_.link.kind == LinkKind::kHid;
  if (!found) {
    from.add_error("header",
                   "nothing tells where this packet begins: give it a header or a checksum, or "
                   "the device a delimiter");
  }
  const std::size_t marks = packet.header.size() + packet.end.size() + table_.delimiter.size();
  if (marks > packet.min_bytes) {
    from.add_error("bytes", "the packet is shorter than its header and end");
  }
  for (TableReader& field : from.tables("field", kMaxFields)) {
    if (good()) read_field(field, packet);
  }
  from.finish();
  table_.packets.push_back(std::move(packet));
}

void PacketReader::read_line(TableReader& from) {
  int columns = 0;
  std::string prefix;
  from.read("columns", columns, {1, kMaxColumns});
  from.read("prefix", prefix);
  if (prefix.size() > kMaxMarkBytes) from.add_error("prefix", "a prefix has at most 16 characters");
  if (table_.link.kind == LinkKind::kHid) {
    from.add_error("columns", "lines of text come over kind = \"serial\" or \"tcp\"");
  }
  if (table_.delimiter.empty()) table_.delimiter = {std::byte{'\n'}};
  PacketRule packet;
  packet.columns = static_cast<std::size_t>(columns);
  const auto bytes = std::as_bytes(std::span(prefix));
  packet.header.assign(bytes.begin(), bytes.end());
  for (TableReader& field : from.tables("field", kMaxFields)) {
    if (good()) read_field(field, packet);
  }
  from.finish();
  table_.packets.push_back(std::move(packet));
}

void PacketReader::read_length(TableReader& from, PacketRule& packet) {
  int bytes = 0;
  from.read("bytes", bytes, {1, kMaxBytes});
  from.need("bytes",
            "it is the length of the packet: bytes = 24; with a length field in the packet, the "
            "least that it can be");
  if (!good()) return;
  packet.min_bytes = packet.max_bytes = static_cast<std::size_t>(bytes);
  auto length = from.table("length");
  if (!length) return;
  int byte = 0;
  int bits = 8;
  length->need("byte", "it is where the length stands: byte = 2");
  length->read("byte", byte, {0, kMaxBytes - 1});
  length->read("bits", bits, {1, 16});
  length->read("add", packet.length.add, kPlaces);
  packet.length.fixed = false;
  packet.max_bytes = kMaxPacketBytes;
  const bool big = length->choice("order", kOrders) == 1;
  packet.length.place = place(*length, 8 * byte, bits, big, packet);
  length->finish();
}

void PacketReader::read_checksum(TableReader& from, PacketRule& packet) {
  auto sum = from.table("checksum");
  if (!sum) return;
  ChecksumRule& rule = packet.checksum;
  rule.kind = static_cast<ChecksumKind>(sum->choice("kind", kChecksums));
  const int width = rule.kind == ChecksumKind::kCrc32 ? 4 : 1;
  rule.at = -width;
  sum->read("byte", rule.at, kPlaces);
  sum->read("from", rule.from, kPlaces);
  rule.to = rule.at;
  sum->read("to", rule.to, kPlaces);
  rule.big = sum->choice("order", kOrders) == 1;
  sum->finish();
  if (!good()) return;
  const auto length = static_cast<int>(packet.min_bytes);
  // The position must fit in the shortest packet. In a longer packet only positions counted from
  // the end move, away from the rest.
  const auto resolved = [length](int place) { return place < 0 ? length + place : place; };
  if (resolved(rule.at) < 0 || resolved(rule.at) + width > length || resolved(rule.from) < 0 ||
      resolved(rule.to) > length || resolved(rule.from) >= resolved(rule.to)) {
    from.add_error("checksum",
                   "the checksum or the bytes it covers (from, up to but without to) do not lie "
                   "in the packet's " +
                       std::to_string(length) + " bytes");
  }
}

void PacketReader::read_field(TableReader& from, PacketRule& packet) {
  FieldGroup group;
  Field& field = group.field;
  field.kind = static_cast<FieldKind>(from.choice("kind", kKinds));
  const bool text = packet.columns > 0;
  field.form = text ? Form::kText : static_cast<Form>(from.choice("form", kForms));
  std::string name = field.kind == FieldKind::kTime ? "time" : "";
  from.read("name", name);
  std::vector<std::string> names{name};
  from.read("names", names);
  const bool flt = field.form == Form::kFloat;
  int bits = flt || text ? 32 : 8;  // of text: after how many a time wraps
  from.read("bits", bits, {1.0, flt ? 64.0 : 32.0});
  if (flt && bits != 32 && bits != 64) from.add_error("bits", "a float has 32 or 64 bits");
  int at = 0;  // the bit or the column of the first one
  int step = text ? 1 : bits;
  bool big = false;
  if (text) {
    from.read("column", at, {0, kMaxColumns});
    from.need("column", "it is where the value stands in the line, from 0: column = 2");
  } else {
    big = read_first_bit(from, at, step);
  }
  read_range(from, bits, field);
  read_meaning(from, group);
  for (const std::string& one : names) {
    if (!good()) break;
    if (one != "-") {
      field.place = text ? column(from, at, bits, packet) : place(from, at, bits, big, packet);
      add_field(from, one, group, packet);
    }
    at += step;
  }
  from.finish();
}

// Reads where a field's first value begins and the step to its next; returns whether the most
// significant byte comes first.
bool PacketReader::read_first_bit(TableReader& from, int& bit, int& step) {
  int byte = 0;
  from.read("byte", byte, {0, kMaxBytes});
  from.read("bit", bit, {0, 8 * kMaxBytes});
  from.read("step", step, {1, 8 * kMaxBytes});
  const bool big = from.choice("order", kOrders) == 1;
  if (from.has("bit") == from.has("byte")) {
    from.add_error("bit", "a field needs its place: bit = 24, or byte = 3");
  }
  bit += 8 * byte;
  return big;
}

void PacketReader::read_range(TableReader& from, int bits, Field& field) {
  if (field.form == Form::kUnsigned || field.kind == FieldKind::kTime) {
    field.high = std::exp2(bits) - 1.0;
  } else if (field.form == Form::kSigned) {
    field.low = -std::exp2(bits - 1);
    field.high = std::exp2(bits - 1) - 1.0;
  } else {
    field.high = std::numeric_limits<float>::max();
    field.low = -field.high;
  }
  const auto range = from.numbers<2>("range", kRawValues);
  if (!range) return;
  const auto [low, high] = *range;
  if (low >= high || low < field.low || high > field.high) {
    return from.add_error("range",
                          "range is [least, most] of the raw value, within what its bits hold");
  }
  field.low = low;
  field.high = high;
}

void PacketReader::read_meaning(TableReader& from, FieldGroup& group) {
  if (group.field.kind != FieldKind::kTime) {  // a key of another kind has an error of its own
    for (const char* key : {"value", "scale", "offset", "unit"}) from.skip(key);
  }
  switch (group.field.kind) {
    case FieldKind::kTime:
      return from.read("tick_s", group.tick_s, {1e-9, 1.0});
    case FieldKind::kExtra:
      from.read("scale", group.field.scale, kScales);
      from.read("offset", group.field.offset, kScales);
      return from.read("unit", group.unit);
    case FieldKind::kSensor:
      break;
  }
  group.unit = kSensorUnits[from.choice("unit", kSensorUnits)];
  group.value = from.numbers<2>("value", kRawValues).value_or(group.value);
  if (group.value[0] == group.value[1]) {
    from.add_error("value", "value is two different numbers, as [0, 90]");
  }
}

void PacketReader::add_field(TableReader& from, const std::string& name, FieldGroup group,
                             PacketRule& packet) {
  Field& field = group.field;
  const char* key = from.has("names") ? "names" : "name";
  if (!is_name(name)) {
    return from.add_error(key,
                          "a name has up to 32 small letters, digits and _, a letter first; - "
                          "steps over a value");
  }
  if (!names_.insert(name).second) {
    return from.add_error(key, "'" + name + "' is described twice");
  }
  if (field.kind == FieldKind::kTime) {
    if (table_.time_bits != 0) from.add_error("kind", "a device has one time");
    const bool counts = field.form == Form::kUnsigned || field.form == Form::kText;
    if (!counts || field.place.bits < 4 || group.tick_s == 0.0) {
      from.add_error("tick_s",
                     "a time is an unsigned counter of 4 bits or more, with tick_s, the seconds "
                     "of one count");
    }
    table_.tick_s = group.tick_s;
    table_.time_bits = field.place.bits;
  } else if (field.kind == FieldKind::kSensor) {
    field.index = static_cast<std::uint8_t>(table_.model.sensors.size());
    add_sensor(from, name, group);
    packet.poses = true;
  } else {
    field.index = static_cast<std::uint8_t>(table_.extra_names.size());
    if (from.has("value")) {
      from.add_error("value", "value is for sensors; an extra has a scale");
    }
    table_.extra_names.push_back(name);
    table_.extra_units.push_back(group.unit);
  }
  if (2 * table_.model.sensors.size() + table_.extra_names.size() > glove::kMaxGloveValues) {
    from.add_error(
        key, "a sample of a glove holds 64 values: two for each sensor and one for each extra");
  }
  packet.fields.push_back(field);
}

void PacketReader::add_sensor(TableReader& from, const std::string& name, const FieldGroup& group) {
  const Field& field = group.field;
  if (table_.model.sensors.size() == glove::kMaxSensors) {
    return from.add_error("name", "a glove has at most 32 sensors");
  }
  for (const char* key : {"scale", "offset"}) {
    if (!from.has(key)) continue;
    from.add_error(key, "a sensor has no scale: range is its raw value, value what that means");
  }
  const bool real = field.form == Form::kFloat || field.form == Form::kText;
  if (real && !from.has("range")) {
    from.add_error(field.form == Form::kText ? "column" : "form",
                   "a sensor that is a float or text needs its range, as [0, 1]");
  }
  if (!real && field.place.bits > 24 && !from.has("range")) {
    from.add_error("bits", "a sensor of more than 24 bits needs its range, as [0, 16383]");
  }
  const double factor = group.unit == "deg" ? kDegree : 1.0;
  table_.model.sensors.push_back({.name = name,
                                  .raw_min = field.low,
                                  .raw_max = field.high,
                                  .curve = glove::Curve::line(field.low, group.value[0] * factor,
                                                              field.high, group.value[1] * factor),
                                  .unit = group.unit == "1" ? "1" : "rad"});
}

BitPlace PacketReader::place(TableReader& from, int bit, int bits, bool big,
                             const PacketRule& packet) {
  const char* key = from.has("bit") ? "bit" : "byte";
  const int shift = bit % 8;
  const int bytes = (shift + bits + 7) / 8;
  if (std::cmp_greater(bit / 8 + bytes, packet.min_bytes)) {
    from.add_error(key, "byte " + std::to_string(bit / 8 + bytes - 1) +
                            " is not in the packet: it has " + std::to_string(packet.min_bytes) +
                            " bytes, counted from 0");
  }
  if (bytes > 8) from.add_error(key, "a 64-bit value begins at a whole byte");
  // Little-endian: bit 0 is the lowest of the first byte. Big-endian: it is the highest.
  return {.first = static_cast<std::uint16_t>(bit / 8),
          .bytes = static_cast<std::uint8_t>(bytes),
          .shift = static_cast<std::uint8_t>(big ? 8 * bytes - shift - bits : shift),
          .bits = static_cast<std::uint8_t>(bits),
          .big = big};
}

BitPlace PacketReader::column(TableReader& from, int column, int bits, const PacketRule& packet) {
  if (std::cmp_greater_equal(column, packet.columns)) {
    from.add_error("column", "column " + std::to_string(column) + " is not in the line: it has " +
                                 std::to_string(packet.columns) + " columns, counted from 0");
  }
  return {.first = static_cast<std::uint16_t>(column),
          .bytes = static_cast<std::uint8_t>(packet.header.size()),
          .bits = static_cast<std::uint8_t>(bits)};
}

void read_device(TableReader& device, Findings& findings, Table& table) {
  device.read("name", table.name);
  if (table.name.empty()) device.add_error("name", "a device needs a name");
  device.read("summary", table.summary);
  device.read("rate_hz", table.rate_hz, kRates_hz);
  table.delimiter = device.hex("delimiter", kMaxDelimiter);
  device.need("link", "write [link] with kind = \"serial\", \"tcp\" or \"hid\"");
  read_link(device, table.link);
  device.need("packet", "describe one or several with [[packet]]");
  PacketReader reader(findings, table);
  for (TableReader& packet : device.tables("packet", kMaxPackets)) {
    if (findings.errors.empty()) reader.read_packet(packet);
  }
  if (findings.errors.empty() && table.model.sensors.empty()) {
    device.add_error("packet", "a glove needs at least one [[packet.field]] of kind \"sensor\"");
  }
  device.skip("note");    // for people
  device.skip("angles");  // parse_angle_map() reads them
  device.finish();
}

bool describes_packets(std::string_view toml) { return toml.find("[[packet]]") != toml.npos; }

}  // namespace

Result<Table> parse_device(const std::string& toml, const std::string& file) {
  const auto root = TRY(parse_toml(toml, file, {.what = kWhat, .bytes = kMaxDeviceFile}));
  Findings findings{.file = file};
  TableReader device(root, "", findings);
  Table read;
  read_device(device, findings, read);
  auto table = TRY(findings.result(std::move(read)));
  table.model.driver = "described";
  table.model.map_toml = toml;
  TRY(glove::parse_angle_map(toml, file, table.model.sensors));
  return table;
}

std::vector<std::string> shipped_devices() {
  std::vector<std::string> names;
  for (const ConfigText& text : device_texts()) {
    if (!describes_packets(text.content)) continue;  // an angle map for another driver
    names.emplace_back(text.file.substr(0, text.file.find('.')));
  }
  return names;
}

Result<std::string> device_text(const std::string& device) {
  if (device.ends_with(kDeviceEnding)) {
    return load_file(device, {.what = kWhat, .max_bytes = kMaxDeviceFile});
  }
  for (const ConfigText& text : device_texts()) {
    if (text.file == device + ".toml" && describes_packets(text.content))
      return std::string(text.content);
  }
  std::string known;
  for (const std::string& shipped : shipped_devices()) known += " " + shipped;
  return misuse("posed knows no device " + in_quotes(device) + ", only" + known +
                "; a description of your own is a path that ends in .toml");
}

}  // namespace posed::drivers::described
