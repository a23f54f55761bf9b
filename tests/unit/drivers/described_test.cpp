// Table-driven devices: the shipped descriptions against what is known of the devices, a glove with
// a user's own description, and mistakes in a description.
#include <catch2/catch.hpp>

#include <cmath>
#include <fstream>
#include <numbers>
#include <numeric>
#include <sstream>

#include "drivers/described/device_file.hpp"
#include "drivers/described/emulator.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/chunk_text.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::drivers {
namespace {

using described::DescribedEmulator;
using described::Table;
using test::Bytes;
using test::bytes_of_hex;

Table must_parse(const std::string& toml) {
  auto table = described::parse_device(toml, "test.toml");
  if (!table) FAIL(table.error().text());
  return std::move(*table);
}

Table shipped(const std::string& name) {
  const auto text = described::device_text(name);
  REQUIRE(text);
  return must_parse(*text);
}

std::unique_ptr<Decoder> decoder_for(const std::string& toml) {
  const auto description =
      find_driver("described")->describe("described hand=right\n" + toml, "test");
  if (!description) FAIL(description.error().text());
  auto decoder = find_driver("described")->make_decoder(*description);
  if (!decoder) FAIL(decoder.error().text());
  return std::move(*decoder);
}

DescribedEmulator emulator_of(const Table& table) {
  const auto calibration = glove::default_calibration(table.model);
  REQUIRE(calibration);
  return DescribedEmulator(std::make_shared<const Table>(table), *calibration);
}

void turn_on(const Table& table, Emulator& emulator) {
  Bytes answer;
  emulator.receive(table.link.start, 0, answer);
  CHECK(answer.empty());
  REQUIRE(emulator.next_due_ns() == 0);
}

std::size_t place_of(const SampleLayout& layout, const std::string& name) {
  const auto at = std::ranges::find(layout.names, name);
  REQUIRE(at != layout.names.end());
  return static_cast<std::size_t>(at - layout.names.begin());
}

// A row of the recorded VMG30: tick [ms], time [s], 23 sensors, 8 parts of quaternions.
std::vector<std::vector<double>> vmg30_rows(const std::filesystem::path& path) {
  std::vector<std::vector<double>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    auto& row = rows.emplace_back();
    for (double value = 0.0; words >> value;) row.push_back(value);
    REQUIRE(row.size() == 33);
  }
  return rows;
}

// Which of the log's 23 sensors each value is, as vmg30.py numbers them.
const std::map<std::string, std::size_t> kVmg30Sensors{
    {"thumb_mcp", 1},  {"thumb_ip", 0},   {"index_mcp", 3},  {"index_pip", 2},
    {"middle_mcp", 5}, {"middle_pip", 4}, {"ring_mcp", 7},   {"ring_pip", 6},
    {"little_mcp", 9}, {"little_pip", 8}, {"palm_arch", 10}, {"thumb_cross", 12},
    {"thumb_abd", 19}, {"index_abd", 20}, {"ring_abd", 21},  {"little_abd", 22}};
const std::map<std::string, std::size_t> kVmg30Extras{
    {"sensor_11", 11},    {"sensor_13", 13},  {"thumb_press", 14}, {"index_press", 15},
    {"middle_press", 16}, {"ring_press", 17}, {"little_press", 18}};
const std::vector<std::string> kVmg30Quaternions{"wrist_qw", "wrist_qx", "wrist_qy", "wrist_qz",
                                                 "hand_qw",  "hand_qx",  "hand_qy",  "hand_qz"};

void set_row(const std::vector<double>& row, const Table& table, DescribedEmulator& glove) {
  glove.set_ticks(static_cast<std::uint64_t>(row[0]));
  for (std::size_t s = 0; s < table.model.sensors.size(); ++s) {
    glove.set_sensor(s, row[2 + kVmg30Sensors.at(table.model.sensors[s].name)]);
  }
  for (std::size_t e = 0; e < table.extra_names.size(); ++e) {
    const std::string& name = table.extra_names[e];
    const auto q = std::ranges::find(kVmg30Quaternions, name);
    if (q != kVmg30Quaternions.end()) {
      glove.set_extra(e, row[25 + static_cast<std::size_t>(q - kVmg30Quaternions.begin())]);
    } else if (kVmg30Extras.contains(name)) {
      glove.set_extra(e, row[2 + kVmg30Extras.at(name)] / 1000.0);
    }
  }
}

// Two packets of different length, no checksum, a delimiter; bit fields across bytes in both
// orders.
constexpr const char* kOwnGlove = R"(
name = "own"
rate_hz = 50
delimiter = "ff fe"

[link]
kind = "tcp"
listen = "127.0.0.1:6000"

[[packet]]
header = "01"
bytes = 9
[[packet.field]]
names = ["thumb", "-", "index"]
bit = 10
bits = 6
step = 9
order = "big"
value = [0, 90]
unit = "deg"
[[packet.field]]
kind = "time"
byte = 5
bits = 12
tick_s = 0.02

[[packet]]
header = "02"
bytes = 5
[[packet.field]]
name = "battery"
kind = "extra"
bit = 12
bits = 7
scale = 0.01

[angles]
thumb = [{channel = "thumb2_x"}]
index = [{channel = "index1_x"}, {channel = "index2_x"}]
)";

}  // namespace

TEST_CASE("the shipped descriptions are valid and emulate what they decode") {
  CHECK(described::shipped_devices() ==
        std::vector<std::string>{"bebop_forte", "opencyberglove", "vmg30"});
  for (const std::string& name : described::shipped_devices()) {
    INFO(name);
    const Table table = shipped(name);
    CHECK(table.name == name);
    const auto decoder = decoder_for(*described::device_text(name));
    DescribedEmulator glove = emulator_of(table);
    Bytes answer;
    glove.receive(table.link.start, 0, answer);
    HandAngles fist{};
    for (std::size_t i = 0; i < fist.size(); i += 3) fist[i] = 0.6;
    glove.pose(0, drivers::glove::hand_frame(fist));
    test::CollectSink sink;
    Bytes bytes;
    while (sink.frames.size() < 10) {
      bytes.clear();
      glove.emit(glove.next_due_ns(), bytes);
      decoder->feed(bytes, 0, sink);
      REQUIRE(sink.count(Outcome::kOk) < 100);
    }
    const auto found = static_cast<double>(sink.frames.back().angle_rad[10]);  // index1_x
    CHECK(found == Approx(0.6).margin(1.6 / 127));
    CHECK(sink.count(Outcome::kOk) ==
          std::accumulate(sink.outcomes.begin(), sink.outcomes.end(), 0));
    glove.receive(table.link.stop, 0, answer);
    CHECK((glove.next_due_ns() == kNoTime_ns) == !table.link.stop.empty());
  }
}

TEST_CASE("a recorded VMG30, turned back into bytes, comes back equal") {
  const auto log = test::shared("data/gloves/vmg30/bottle_data_1750948857014344353.txt");
  if (!log) SKIP_WITHOUT_SHARED();
  const Table table = shipped("vmg30");
  const auto rows = vmg30_rows(*log);
  REQUIRE(rows.size() == 300);
  const auto description =
      find_driver("described")
          ->describe("described hand=right\n" + *described::device_text("vmg30"), "log");
  REQUIRE(description);
  const auto decoder = find_driver("described")->make_decoder(*description);
  REQUIRE(decoder);
  DescribedEmulator glove = emulator_of(table);
  turn_on(table, glove);
  test::CollectSink sink;
  for (const auto& row : rows) {
    set_row(row, table, glove);
    Bytes bytes;
    glove.emit(glove.next_due_ns(), bytes);
    CHECK(bytes.size() == 90);
    (*decoder)->feed(bytes, 0, sink);
  }
  REQUIRE(sink.samples.size() == rows.size());
  REQUIRE(sink.frames.size() == rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto value = [&](const std::string& name) {
      const std::size_t at = place_of(description->samples, name);
      CHECK(sink.samples[i].valid[at]);
      return sink.samples[i].value[at];
    };
    CHECK(sink.samples[i].header.device_ns ==
          static_cast<std::int64_t>(rows[i][0] - rows[0][0]) * 1'000'000);
    for (const auto& [name, n] : kVmg30Sensors) {
      CHECK(value("raw_" + name) == static_cast<float>(rows[i][2 + n]));
    }
    for (const auto& [name, n] : kVmg30Extras) {
      CHECK(value(name) == static_cast<float>(rows[i][2 + n] * 0.001));
    }
    for (std::size_t q = 0; q < 8; ++q) {
      CHECK(value(kVmg30Quaternions[q]) == static_cast<float>(rows[i][25 + q]));
    }
  }
}

TEST_CASE("the VMG30's start is the bytes that its driver sends") {
  const Table table = shipped("vmg30");
  const auto sum = [](const Bytes& bytes) {
    unsigned all = 0;
    for (std::size_t i = 0; i + 2 < bytes.size(); ++i) all += std::to_integer<unsigned>(bytes[i]);
    return static_cast<std::byte>(all & 0xFF);
  };
  CHECK(table.link.start[4] == sum(table.link.start));
  CHECK(table.link.stop[4] == sum(table.link.stop));
}

TEST_CASE("an unknown glove works from its description alone") {
  const auto decoder = decoder_for(kOwnGlove);
  test::CollectSink sink;
  // Bits 10-15: 63, bits 28-33 (big): 21, counter 0x123, then the delimiter.
  decoder->feed(bytes_of_hex("01 3f 00 05 40 23 01 ff fe"), 0, sink);
  REQUIRE(sink.samples.size() == 1);
  REQUIRE(sink.frames.size() == 1);
  CHECK(sink.samples[0].value[2] == 63.0F);  // raw_thumb
  CHECK(sink.samples[0].value[3] == 21.0F);  // raw_index
  CHECK(sink.samples[0].value[0] == Approx(std::numbers::pi / 2));
  CHECK(sink.samples[0].value[1] == Approx(std::numbers::pi / 6));
  CHECK_FALSE(sink.samples[0].valid[4]);  // the battery level is not known yet
  CHECK(sink.samples[0].header.device_ns == 0);
  decoder->feed(bytes_of_hex("02 00 05 ff fe"), 0, sink);
  CHECK(sink.samples.size() == 1);
  decoder->feed(bytes_of_hex("01 3f 00 05 40 25 01 ff fe"), 0, sink);
  REQUIRE(sink.samples.size() == 2);
  CHECK(sink.samples[1].valid[4]);
  CHECK(sink.samples[1].value[4] == Approx(0.80));
  CHECK(sink.samples[1].header.device_ns == 40'000'000);
  CHECK(sink.count(Outcome::kOk) == 3);
}

TEST_CASE("lines of text with a prefix and columns are a glove, too") {
  const std::string toml = R"(
name = "text"
[link]
kind = "serial"
[[packet]]
columns = 5
prefix = "A "
[[packet.field]]
names = ["thumb", "-", "index"]
column = 1
range = [0, 1023]
value = [0, 90]
unit = "deg"
[[packet.field]]
name = "battery"
kind = "extra"
column = 4
scale = 0.01
[[packet.field]]
kind = "time"
column = 0
tick_s = 0.001
[angles]
thumb = [{ channel = "thumb2_x" }]
index = [{ channel = "index2_x" }]
)";
  const auto decoder = decoder_for(toml);
  test::CollectSink sink;
  // The first line may have lost its begin. Blanks, tabs and semicolons separate as commas do.
  decoder->feed(test::bytes_of(" 3,4,5\nA 1000,1023,x,341.0,80\r\nA 1010; 511.5\t2 341 7"), 0,
                sink);
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.samples[0].value[2] == 1023.0F);
  CHECK(sink.samples[0].value[0] == Approx(std::numbers::pi / 2));
  CHECK(sink.samples[0].value[1] == Approx(std::numbers::pi / 6));
  CHECK(sink.samples[0].value[4] == Approx(0.8));
  decoder->feed(test::bytes_of("5\n"), 0, sink);
  REQUIRE(sink.samples.size() == 2);
  CHECK(sink.samples[1].value[2] == 511.5F);
  CHECK(sink.samples[1].header.device_ns == 10'000'000);
  decoder->feed(test::bytes_of("A 1010,1,2,3\nA 1,2,3,4,5,6\nA 1,2000,0,0,0\nA 1,,0,0,0\nB\n"
                               "A 1020,0,0,0,\nA 1020.5,0,0,0,0\n"),
                0, sink);
  CHECK(sink.count(Outcome::kShort) == 3);
  CHECK(sink.count(Outcome::kOutOfRange) == 3);
  CHECK(sink.count(Outcome::kForeign) == 1);
  CHECK(sink.samples.size() == 2);
  // What is emulated is read back.
  const Table table = must_parse(toml);
  auto emulator = emulator_of(table);
  emulator.set_sensor(0, 12.5);
  emulator.set_extra(0, 0.5);
  emulator.set_ticks(2000);
  Bytes out;
  emulator.emit(0, out);
  CHECK(test::text_of(out) == "A 2000,12.5,0,0,50\n");
  decoder->feed(out, 0, sink);
  REQUIRE(sink.samples.size() == 3);
  CHECK(sink.samples[2].value[2] == 12.5F);
  CHECK(sink.samples[2].header.device_ns == 1'000'000'000);
  const auto mistake = [&](const std::string& from, const std::string& to) {
    std::string wrong = toml;
    wrong.replace(wrong.find(from), from.size(), to);
    const auto read = described::parse_device(wrong, "own.toml");
    return read ? "" : read.error().text();
  };
  CHECK(test::has(mistake("column = 4", "column = 5"), "it has 5 columns, counted from 0"));
  CHECK(test::has(mistake("column = 4", "byte = 4"),
                  "column is missing; it is where the value stands"));
  CHECK(test::has(mistake("range = [0, 1023]", ""), "needs its range"));
  CHECK(test::has(mistake("[angles]", "[[packet]]\nbytes = 3\nheader = \"01\"\n[angles]"),
                  "not both"));
  CHECK(test::has(mistake("\"serial\"", "\"hid\"\nvendor = 1\nproduct = 2"), "come over kind ="));
}

TEST_CASE("the bytes between two delimiters are a packet, or are counted once") {
  const auto decoder = decoder_for(kOwnGlove);
  test::CollectSink sink(16);
  decoder->feed(bytes_of_hex("01 3f 00 05 40 23 ff fe 01 3f 00 05 40 23 01 ff fe 03 ff fe"), 0,
                sink);
  CHECK(sink.count(Outcome::kShort) == 1);
  CHECK(sink.count(Outcome::kForeign) == 1);
  CHECK(sink.count(Outcome::kOk) == 1);
  sink.clear();
  const Bytes endless(5000, std::byte{1});
  decoder->feed(endless, 0, sink);
  decoder->feed(bytes_of_hex("ff fe 01 3f 00 05 40 24 01 ff fe"), 0, sink);
  CHECK(sink.count(Outcome::kShort) == 1);
  CHECK(sink.count(Outcome::kOk) == 1);
}

TEST_CASE("a HID device's reports are never mixed, whatever a short one leaves behind") {
  const auto decoder = decoder_for(R"(
name = "hid"
[link]
kind = "hid"
vendor = 0x1234
product = 0x5678
[[packet]]
header = "07"
bytes = 4
[[packet.field]]
names = ["a", "b", "c"]
byte = 1
[angles]
a = [{channel = "index1_x"}]
)");
  test::CollectSink sink;
  decoder->feed(bytes_of_hex("07 01 02"), 0, sink);        // cut short
  decoder->feed(bytes_of_hex("07 04 05 06"), 0, sink);     // whole
  decoder->feed(bytes_of_hex("08 07 01 02 03"), 0, sink);  // another report that contains a seven
  REQUIRE(sink.samples.size() == 1);
  CHECK(sink.samples[0].value[3] == 4.0F);
  CHECK(sink.samples[0].value[5] == 6.0F);
  CHECK(sink.count(Outcome::kShort) == 1);
  CHECK(sink.count(Outcome::kForeign) == 1);
}

TEST_CASE("a packet without a header is found by its CRC alone, from anywhere") {
  const Table table = shipped("opencyberglove");
  const auto decoder = decoder_for(*described::device_text("opencyberglove"));
  DescribedEmulator glove = emulator_of(table);
  Bytes bytes;
  for (int i = 0; i < 4; ++i) glove.emit(glove.next_due_ns(), bytes);
  REQUIRE(bytes.size() == 4 * 132);
  bytes.erase(bytes.begin(), bytes.begin() + 50);
  bytes[200] ^= std::byte{1};  // in the second
  test::CollectSink sink;
  decoder->feed(bytes, 0, sink);
  CHECK(sink.count(Outcome::kOk) == 2);
  CHECK(sink.count(Outcome::kBadChecksum) ==
        1);  // one search for a packet, from the damage to the third packet
}

TEST_CASE("a mistake in a description is reported with its line and what is allowed") {
  const std::string own = kOwnGlove;
  const auto mistake = [&](const std::string& from, const std::string& to) {
    std::string toml = own;
    const std::size_t at = toml.find(from);
    REQUIRE(at != std::string::npos);
    const auto table = described::parse_device(toml.replace(at, from.size(), to), "own.toml");
    REQUIRE_FALSE(table);
    CHECK(table.error().file == "own.toml");
    CHECK(table.error().message.find('\n') == std::string::npos);
    return table.error().text();
  };
  CHECK(mistake("order = ", "ordr = ") ==
        "own.toml:18: unknown key 'packet.field.ordr'; the nearest known one here is 'order'");
  CHECK(mistake("kind = \"tcp\"", "kind = \"bluetooth\"") ==
        "own.toml:7: link.kind must be one of these words in quotes: serial, tcp, hid");
  CHECK(mistake("bits = 6", "bits = 60") ==
        "own.toml:16: packet.field.bits = 60 is out of range: it takes an integer from 1 to 32");
  CHECK(mistake("header = \"01\"", "header = \"1g\"").find("hexadecimal") != std::string::npos);
  CHECK(mistake("byte = 5", "byte = 8").find("byte 9 is not in the packet: it has 9 bytes") !=
        std::string::npos);
  CHECK(mistake("\"index\"", "\"thumb\"").find("'thumb' is described twice") != std::string::npos);
  CHECK(mistake("bytes = 9", "").find("packet.bytes is missing; it is the length of the packet") !=
        std::string::npos);
  CHECK(mistake("tick_s = 0.02", "").find("tick_s") != std::string::npos);
  CHECK(mistake("index2_x", "index4_x").find("no channel 'index4_x'") != std::string::npos);
  CHECK(mistake("rate_hz = 50", "rate_hz = inf").find("from 0 to 1000") != std::string::npos);
  CHECK(mistake("[angles]", "[angles").find("own.toml:") == 0);
}

TEST_CASE("an unknown device is refused with the known ones, a missing file by its path") {
  const auto unknown =
      find_driver("described")->expect({{"device", std::string("/somewhere/vmg31")}});
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().message.find("vmg31', only bebop_forte opencyberglove vmg30") !=
        std::string::npos);
  const auto missing =
      find_driver("described")->expect({{"device", std::string("/nowhere/own.toml")}});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().text().starts_with(
      "/nowhere/own.toml: cannot read the device description: No such file or directory"));
  const auto path = test::scratch_file("own.toml", kOwnGlove);
  const auto expected =
      find_driver("described")->expect({{"device", path.string()}, {"hand", std::string("left")}});
  REQUIRE(expected);
  const auto again = find_driver("described")->describe(expected->text, expected->identity);
  REQUIRE(again);
  CHECK(again->samples.names == expected->samples.names);
  CHECK(again->samples.units == expected->samples.units);
}

}  // namespace posed::drivers
