#include "drivers/described/device_file.hpp"

#include <array>
#include <utility>

#include "drivers/described/packet_reader.hpp"
#include "drivers/glove/angle_map.hpp"
#include "proto/frame/config_texts.hpp"
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
