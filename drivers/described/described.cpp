#include "drivers/described/described.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "drivers/described/decoder.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/described/emulator.hpp"
#include "drivers/described/protocol.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/connect.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/make_device.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::drivers {
namespace described {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kQuiet{50};
constexpr milliseconds kFirstPacket{2000};
constexpr double kSilence_s = 1.0;  // at least this, or this many periods of a slow device:
constexpr double kSilentPeriods = 5.0;

// The text in a log: one line of device info, then the device's description as in its file.
std::string text_of(Side side, const std::string& toml) {
  return "described hand=" + std::string(glove::side_name(side)) + "\n" + toml;
}

struct Described {
  Side side = Side::kRight;
  Table table;
};

Result<Described> parse_text(const std::string& text, const std::string& identity) {
  const std::size_t line_end = std::min(text.find('\n'), text.size());
  glove::DeviceInfoReader reader(text.substr(0, line_end), "described", identity);
  Described made;
  made.side = reader.side();
  if (auto ok = reader.finish(); !ok) return std::unexpected(ok.error());
  if (line_end == text.size()) return fail("lacks the device's description", identity);
  auto table = parse_device(text.substr(line_end + 1), identity);
  if (!table) return std::unexpected(table.error());
  made.table = std::move(*table);
  return made;
}

Result<Description> describe(const std::string& text, const std::string& identity) {
  const auto made = parse_text(text, identity);
  if (!made) return std::unexpected(made.error());
  const Table& table = made->table;
  Description description{.driver = "described",
                          .text = text,
                          .identity = identity,
                          .skeleton = std::make_shared<const Skeleton>(hand_skeleton(made->side)),
                          .samples = glove::sample_layout(table.model, table.extra_names),
                          .rate_hz = table.rate_hz};
  std::ranges::copy_backward(table.extra_units, description.samples.units.end());
  return description;
}

Result<std::unique_ptr<Decoder>> make_decoder(const Description& description) {
  auto made = parse_text(description.text, description.identity);
  if (!made) return std::unexpected(made.error());
  auto calibration = glove::default_calibration(made->table.model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<DescribedDecoder>(std::make_shared<const Table>(std::move(made->table)),
                                            description.skeleton, std::move(*calibration));
}

Result<glove::Model> glove_model(const Description& description) {
  auto made = parse_text(description.text, description.identity);
  if (!made) return std::unexpected(made.error());
  return std::move(made->table.model);
}

// The settings from the options: the hand, and a checked description. Errors name the file.
struct Chosen {
  Options options;
  Side side = Side::kRight;
  std::string toml;
  Table table;
};

Result<Chosen> choose(const Options& given) {
  auto options = complete_options(described_driver(), given);
  if (!options) return std::unexpected(options.error());
  const auto side = glove::hand_option(*options);
  if (!side) return std::unexpected(side.error());
  const auto device = option<std::string>(*options, "device");
  auto toml = device_text(device);
  if (!toml) return std::unexpected(toml.error());
  auto table = parse_device(*toml, device);
  if (!table) return std::unexpected(table.error());
  const std::int64_t baud = option<std::int64_t>(*options, "baud");
  (*options)["baud"] = baud == 0 ? std::int64_t{table->link.baud} : baud;
  if (option<std::string>(*options, "listen").empty()) (*options)["listen"] = table->link.listen;
  const bool tcp = table->link.kind == LinkKind::kTcp;
  (*options)["link"] = std::string(tcp ? "tcp" : "serial");
  return Chosen{std::move(*options), *side, std::move(*toml), std::move(*table)};
}

Result<Description> expect(const Options& given) {
  const auto chosen = choose(given);
  if (!chosen) return std::unexpected(chosen.error());
  if (chosen->table.link.kind != LinkKind::kHid) {
    const auto sound = glove::check_connection(chosen->options);
    if (!sound) return std::unexpected(sound.error());
  }
  const auto& id = option<std::string>(chosen->options, "id");
  const auto& port = option<std::string>(chosen->options, "port");
  return describe(text_of(chosen->side, chosen->toml), id.empty() ? port : id);
}

bool has_packet(const Table& table, std::span<const std::byte> bytes) {
  for (; !bytes.empty(); bytes = bytes.subspan(1)) {
    if (look_for_packet(table, bytes).found == Look::Found::kPacket) {
      return true;
    }
  }
  return false;
}

// Stops the device's stream, starts it, and waits for the first packet that fits the description.
// With a wrong baud rate or another device on the port, none does.
Result<> start(const Table& table, Connection& link) {
  if (!table.link.stop.empty()) {
    if (auto ok = link.write(table.link.stop); !ok) return ok;
    if (auto ok = link.drain(kQuiet); !ok) return ok;
  }
  if (!table.link.start.empty()) {
    if (auto ok = link.write(table.link.start); !ok) return ok;
  }
  std::vector<std::byte> heard;
  const auto until = std::chrono::steady_clock::now() + kFirstPacket;
  while (std::chrono::steady_clock::now() < until && heard.size() < 8 * kMaxPacketBytes) {
    const auto bytes = link.read(kQuiet);
    if (!bytes) return std::unexpected(bytes.error());
    heard.insert(heard.end(), bytes->begin(), bytes->end());
    if (!bytes->empty() && has_packet(table, heard)) return {};
  }
  if (heard.empty()) {
    return fail("nothing came within 2 seconds; is it the " + table.name + ", and switched on?",
                link.name());
  }
  return fail(std::to_string(heard.size()) + " bytes came, but no packet of a " + table.name +
                  "; is another device on this port, or is baud wrong?",
              link.name());
}

Result<Connection> connect(const Chosen& chosen, TransportFactory& ports) {
  const LinkRule& rule = chosen.table.link;
  if (rule.kind != LinkKind::kHid) {
    return glove::connect(chosen.options, ports, rule.usb_ids);
  }
  const std::uint32_t id = rule.usb_ids.front();
  return ports.hid({.vendor = static_cast<std::uint16_t>(id >> 16),
                    .products = {static_cast<std::uint16_t>(id & 0xFFFF)},
                    .id = option<std::string>(chosen.options, "id"),
                    .path = option<std::string>(chosen.options, "port")});
}

Result<Device> open(const Options& given, TransportFactory& ports) {
  const auto chosen = choose(given);
  if (!chosen) return std::unexpected(chosen.error());
  auto link = connect(*chosen, ports);
  if (!link) return std::unexpected(link.error());
  if (auto ok = start(chosen->table, *link); !ok) return std::unexpected(ok.error());
  auto device =
      make_device(described_driver(), text_of(chosen->side, chosen->toml), link->identity());
  if (!device) return device;
  const bool hid = chosen->table.link.kind == LinkKind::kHid;
  device->transport =
      hid ? make_hid_transport(std::move(*link)) : make_link_transport(std::move(*link));
  const double rate_hz = device->description.rate_hz;
  device->reopen_after_s =
      rate_hz > 0.0 ? std::max(kSilence_s, kSilentPeriods / rate_hz) : kSilence_s;
  return device;
}

Result<std::unique_ptr<Emulator>> emulate(const Options& given) {
  auto chosen = choose(given);
  if (!chosen) return std::unexpected(chosen.error());
  auto calibration = glove::default_calibration(chosen->table.model);
  if (!calibration) return std::unexpected(calibration.error());
  return std::make_unique<DescribedEmulator>(
      std::make_shared<const Table>(std::move(chosen->table)), std::move(*calibration));
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> options{
      {.name = "device",
       .default_value = std::string(),
       .required = true,
       .is_path = true,
       .help = "what it is: vmg30, opencyberglove, bebop_forte, or a description's path (.toml)"}};
  for (OptionSpec& spec : glove::serial_options(0)) options.push_back(std::move(spec));
  options.push_back({.name = "listen",
                     .default_value = std::string(),
                     .help = "address and port that a glove with kind = tcp connects to"});
  options.push_back({.name = "peers",
                     .default_value = std::string(),
                     .help = "addresses that may connect, separated by blanks"});
  return options;
}

}  // namespace
}  // namespace described

const Driver& described_driver() {
  static const glove::GloveTraits traits{.glove_model = described::glove_model};
  static const Driver driver{
      .name = "described",
      .summary = "any device that a TOML file describes: VMG30, OpenCyberGlove, BeBop Forte, yours",
      .options = described::all_options(),
      .open = described::open,
      .make_decoder = described::make_decoder,
      .describe = described::describe,
      .expect = described::expect,
      .glove = &traits,
      .emulate = described::emulate};
  return driver;
}

}  // namespace posed::drivers
