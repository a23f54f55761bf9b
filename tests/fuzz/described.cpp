// Table-driven devices: any bytes in chunks of any size through tables of every kind of framing,
// and any text as a device description. The first byte selects what is tested, the second one how
// the rest is cut into chunks.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/described/decoder.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/described/protocol.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::drivers::described::DescribedDecoder;
using posed::drivers::described::parse_device;
using posed::drivers::described::Table;
using posed::fuzz::demand;
using posed::fuzz::feed;
using posed::test::CollectSink;

// A delimiter, odd bits in both orders, and a packet that states its length.
constexpr const char* kDelimited = R"(
name = "delimited"
delimiter = "ff fe"
[link]
kind = "serial"
[[packet]]
header = "01"
bytes = 9
[[packet.field]]
names = ["a", "b"]
bit = 10
bits = 7
order = "big"
[[packet.field]]
kind = "time"
byte = 5
bits = 12
tick_s = 0.02
[[packet]]
bytes = 5
checksum = { kind = "xor8", byte = 2, from = 0, to = 2 }
[[packet.field]]
name = "c"
kind = "extra"
byte = 1
[angles]
a = [{channel = "index1_x"}]
)";
constexpr const char* kLength = R"(
name = "length"
[link]
kind = "tcp"
[[packet]]
header = "aa"
bytes = 8
length = { byte = 1, bits = 16, add = 3 }
end = "55"
checksum = { kind = "sum8", byte = -2, from = 1, to = -2 }
[[packet.field]]
name = "a"
byte = 3
bits = 16
form = "signed"
[[packet]]
header = "aa"
bytes = 6
checksum = { kind = "sum8" }
[[packet.field]]
name = "f"
kind = "extra"
byte = 1
form = "float"
[angles]
a = [{channel = "index1_x"}]
)";
constexpr const char* kHid = R"(
name = "hid"
[link]
kind = "hid"
vendor = 1
product = 2
[[packet]]
header = "07"
bytes = 5
[[packet.field]]
names = ["a", "b"]
bit = 9
bits = 15
[angles]
b = [{channel = "index1_x"}]
)";

constexpr const char* kText = R"(
name = "text"
[link]
kind = "serial"
[[packet]]
columns = 4
prefix = "A "
[[packet.field]]
names = ["a", "-", "b"]
column = 0
range = [-5, 1023]
[[packet.field]]
kind = "time"
column = 3
bits = 12
tick_s = 0.01
[angles]
a = [{channel = "index1_x"}]
)";

std::shared_ptr<const Table> table_of(const std::string& toml) {
  auto table = parse_device(toml, "fuzz.toml");
  demand(table.has_value());
  return std::make_shared<const Table>(std::move(*table));
}

const std::vector<std::shared_ptr<const Table>>& tables() {
  static const auto all = [] {
    std::vector<std::shared_ptr<const Table>> made;
    for (const std::string& name : posed::drivers::described::shipped_devices()) {
      made.push_back(table_of(*posed::drivers::described::device_text(name)));
    }
    for (const char* const toml : {kDelimited, kLength, kHid, kText})
      made.push_back(table_of(toml));
    return made;
  }();
  return all;
}

DescribedDecoder decoder_of(const std::shared_ptr<const Table>& table) {
  static const auto skeleton =
      std::make_shared<const posed::Skeleton>(posed::hand_skeleton(posed::Side::kRight));
  auto calibration = posed::drivers::glove::default_calibration(table->model);
  demand(calibration.has_value());
  return DescribedDecoder(table, skeleton, *calibration);
}

void check(const CollectSink& sink) {
  std::int64_t before_ns = posed::kNoTime_ns;
  for (const posed::Frame& frame : sink.frames) {
    demand(posed::test::is_valid(frame) && frame.header.device_ns >= before_ns);
    before_ns = frame.header.device_ns;
  }
  for (const posed::Sample& sample : sink.samples) demand(posed::test::is_valid(sample));
}

void try_bytes(const std::shared_ptr<const Table>& table, std::size_t piece,
               std::span<const std::byte> bytes) {
  CollectSink whole(0);
  auto decoder_of_whole = decoder_of(table);
  feed(decoder_of_whole, bytes, 0, whole);
  check(whole);
  CollectSink cut(0);
  auto decoder = decoder_of(table);
  while (!bytes.empty()) {
    const std::size_t length = std::min(piece, bytes.size());
    feed(decoder, bytes.first(length), 0, cut);
    bytes = bytes.subspan(length);
  }
  check(cut);
  if (table->link.kind == posed::drivers::described::LinkKind::kHid)
    return;  // a chunk consists of whole reports
  demand(cut.outcomes == whole.outcomes && cut.samples.size() == whole.samples.size());
  for (std::size_t i = 0; i < cut.samples.size(); ++i) {
    demand(posed::test::same_values(cut.samples[i], whole.samples[i]));
  }
}

// An accepted description decodes any bytes, and the packets that it encodes itself.
void try_description(const std::string& toml, std::span<const std::byte> bytes) {
  auto table = parse_device(toml, "fuzz.toml");
  if (!table) {
    demand(!table.error().message.empty());
    demand(table.error().text().find('\x1b') == std::string::npos);  // no terminal escape sequences
    return;
  }
  const auto shared = std::make_shared<const Table>(std::move(*table));
  try_bytes(shared, 7, bytes);
  for (const auto& rule : shared->packets) {
    auto packet = blank_packet(*shared, rule);
    for (const auto& field : rule.fields) write_field(field, field.high, packet);
    write_checksum(rule, packet);
    try_bytes(shared, 3, packet);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span bytes = std::as_bytes(std::span(data + 2, size - 2));
  const std::size_t which = data[0] % (tables().size() + 1);
  if (which < tables().size()) {
    try_bytes(tables()[which], 1U + data[1], bytes);
  } else {
    try_description(std::string(reinterpret_cast<const char*>(data + 2), size - 2), bytes);
  }
  return 0;
}
