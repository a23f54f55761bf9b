#include "drivers/described/device_file.hpp"

#include <array>

#include "drivers/described/packet_reader.hpp"
#include "drivers/described/toml_reader.hpp"
#include "drivers/glove/angle_map.hpp"
#include "proto/frame/profile_texts.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/load_file.hpp"

namespace posed::drivers::described {
namespace {

constexpr std::string_view kWhat = "device description";
constexpr std::array<std::string_view, 3> kLinks{"serial", "tcp", "hid"};
constexpr std::array<std::string_view, 8> kDeviceKeys{"name",      "summary", "note",   "rate_hz",
                                                      "delimiter", "link",    "packet", "angles"};
constexpr std::array<std::string_view, 8> kLinkKeys{"kind",    "baud",   "vendor", "product",
                                                    "usb_ids", "listen", "start",  "stop"};
constexpr std::size_t kMaxCommand = 64;
constexpr std::size_t kMaxDelimiter = 4;
constexpr std::size_t kMaxUsbIds = 16;
constexpr std::int64_t kMaxBaud = 4'000'000;
constexpr double kMaxRate_hz = 1000.0;

void read_usb_ids(TomlReader& toml, const toml::table& link, LinkRule& rule) {
  const auto add_error = [&] {
    toml.add_error(link,
                   "USB ids are written as vendor = 0x1234 and product = 0x5678, or for a serial "
                   "port as usb_ids = [0x12345678]: vendor and product in one number");
  };
  if (link.contains("vendor") != link.contains("product")) add_error();
  if (link.contains("vendor")) {
    const auto vendor = toml.whole(link, "vendor", 0, 0, 0xFFFF);
    const auto product = toml.whole(link, "product", 0, 0, 0xFFFF);
    rule.usb_ids.push_back(static_cast<std::uint32_t>(vendor << 16 | product));
  }
  const toml::node* const more = link.get("usb_ids");
  if (more == nullptr) return;
  const toml::array* const list = more->as_array();
  if (list == nullptr || list->size() > kMaxUsbIds) return add_error();
  for (const toml::node& id : *list) {
    const auto value = id.value<std::int64_t>();
    if (!value || *value < 0 || *value > 0xFFFFFFFF) return add_error();
    rule.usb_ids.push_back(static_cast<std::uint32_t>(*value));
  }
}

void read_link(TomlReader& toml, const toml::table& device, LinkRule& rule) {
  const toml::table* const link = toml.table(device, "link");
  if (link == nullptr)
    return toml.add_error(device, "a device needs its [link]: kind = \"serial\"");
  toml.allow(*link, "[link]", kLinkKeys);
  rule.kind = static_cast<LinkKind>(toml.word(*link, "kind", kLinks, 0));
  rule.baud = static_cast<int>(toml.whole(*link, "baud", rule.baud, 1, kMaxBaud));
  rule.listen = toml.text(*link, "listen", rule.listen);
  rule.start = toml.hex(*link, "start", kMaxCommand);
  rule.stop = toml.hex(*link, "stop", kMaxCommand);
  read_usb_ids(toml, *link, rule);
  const bool hid = rule.kind == LinkKind::kHid;
  if (hid && (!link->contains("vendor") || link->contains("usb_ids"))) {
    toml.add_error(*link, "a HID device is found by vendor = 0x1234 and product = 0x5678");
  }
}

void read_packets(TomlReader& toml, const toml::table& device, Table& table) {
  const toml::array* const packets = device["packet"].as_array();
  if (packets == nullptr) return toml.add_error(device, "a device needs at least one [[packet]]");
  PacketReader reader(toml, table);
  for (const toml::node& packet : *packets) {
    if (!packet.is_table()) return toml.add_error(packet, "packets are written as [[packet]]");
    reader.read_packet(*packet.as_table());
    if (toml.error()) return;
  }
  if (table.model.sensors.empty()) {
    toml.add_error(device, "a glove needs at least one [[packet.field]] of kind \"sensor\"");
  }
}

Result<Table> read_device(const toml::table& device, const std::string& text,
                          const std::string& file) {
  TomlReader toml(file);
  Table table;
  toml.allow(device, "a device", kDeviceKeys);
  table.name = toml.text(device, "name");
  if (table.name.empty()) toml.add_error(device, "a device needs a name");
  table.summary = toml.text(device, "summary");
  table.rate_hz = toml.number(device, "rate_hz", 0.0, 0.0, kMaxRate_hz);
  table.delimiter = toml.hex(device, "delimiter", kMaxDelimiter);
  read_link(toml, device, table.link);
  if (!toml.error()) read_packets(toml, device, table);
  if (toml.error()) return std::unexpected(*toml.error());
  table.model.driver = "described";
  table.model.map_toml = text;
  if (const auto rows = glove::parse_angle_map(text, file, table.model.sensors); !rows) {
    return std::unexpected(rows.error());
  }
  return table;
}

bool describes_packets(std::string_view toml) { return toml.find("[[packet]]") != toml.npos; }

}  // namespace

Result<Table> parse_device(const std::string& toml, const std::string& file) {
  const auto table = parse_toml(toml, file, {.what = kWhat, .bytes = kMaxDeviceFile});
  if (!table) return std::unexpected(table.error());
  return read_device(*table, toml, file);
}

std::vector<std::string> shipped_devices() {
  std::vector<std::string> names;
  for (const ProfileText& text : device_texts()) {
    if (!describes_packets(text.toml)) continue;  // an angle map for another driver
    names.emplace_back(text.file.substr(0, text.file.find('.')));
  }
  return names;
}

Result<std::string> device_text(const std::string& device) {
  if (device.ends_with(".toml")) {
    return load_file(device, {.what = kWhat, .max_bytes = kMaxDeviceFile});
  }
  // The config reader makes every path absolute, including a plain name: the name is its last part.
  const std::string name = std::filesystem::path(device).filename().string();
  for (const ProfileText& text : device_texts()) {
    if (text.file == name + ".toml" && describes_packets(text.toml)) return std::string(text.toml);
  }
  std::string known;
  for (const std::string& shipped : shipped_devices()) known += " " + shipped;
  return misuse("posed knows no device " + in_quotes(name) + ", only" + known +
                "; a description of your own is a path that ends in .toml");
}

}  // namespace posed::drivers::described
