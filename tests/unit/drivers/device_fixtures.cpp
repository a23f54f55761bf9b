#include "tests/unit/drivers/device_fixtures.hpp"

#include <catch2/catch.hpp>

#include <unistd.h>

#include <fstream>
#include <map>

#include "drivers/transport/transport_factory.hpp"
#include "tests/unit/drivers/emulated.hpp"

namespace posed::test {
namespace {

struct ScratchFolder {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("posed-drivers-" + std::to_string(::getpid()));
  ScratchFolder() { std::filesystem::create_directories(path); }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

std::vector<DeviceFixture> make_specimens() {
  const auto bvh = scratch_file("small.bvh", small_bvh());
  const auto amc = scratch_file("01_02.amc", small_amc());
  const auto asf = scratch_file("small.asf", small_asf());
  const auto hand = scratch_file("hand.csv", small_hand_csv());
  return {
      {.name = "axis",
       .driver = "axis",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 2,
       .chunk_packets = 2,
       .emulated = true},
      {.name = "axis-text",
       .driver = "axis",
       .options = {{"format", std::string("text")}, {"reference", true}},
       .loop_chunks = 24,
       .chunk_frames = 2,
       .chunk_packets = 2,
       .emulated = true},
      {.name = "cyberglove-16bit",
       .driver = "cyberglove",
       .options = {{"form", std::string("16bit")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .start = "1m\x03"
                "1S"},
      {.name = "cyberglove-18",
       .driver = "cyberglove",
       .options = {{"sensors", std::int64_t{18}}, {"hand", std::string("left")}, {"time", false}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .start = "u 1\rS"},
      {.name = "cyberglove-22",
       .driver = "cyberglove",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .start = "u 1\rd 1\rt 1152 1\rS"},
      {.name = "described-bebop-forte",
       .driver = "described",
       .options = {{"device", std::string("bebop_forte")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .chunk_packets = 2,
       .emulated = true,
       .start = "\xb0\x76\x01\xb0\x73\x01"},
      {.name = "described-opencyberglove",
       .driver = "described",
       .options = {{"device", std::string("opencyberglove")}, {"hand", std::string("left")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      {.name = "described-vmg30",
       .driver = "described",
       .options = {{"device", std::string("vmg30")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .start = "\x24\x0a\x03\x01\x32\x23"},
      {.name = "file, bvh",
       .driver = "file",
       .options = {{"path", bvh.string()}, {"pace", 0.0}},
       .loop_chunks = 5,
       .chunk_frames = 1},
      {.name = "file, amc",
       .driver = "file",
       .options = {{"path", amc.string()}, {"skeleton", asf.string()}, {"pace", 0.0}},
       .loop_chunks = 5,
       .chunk_frames = 1},
      {.name = "file, hand csv",
       .driver = "file",
       .options = {{"path", hand.string()}, {"pace", 0.0}, {"hand", std::string("left")}},
       .loop_chunks = 5,
       .chunk_frames = 1},
      {.name = "fivedt-5",
       .driver = "fivedt",
       .options = {{"model", std::string("5")}, {"hand", std::string("right")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .start = "AD"},
      {.name = "fivedt-5-wireless",
       .driver = "fivedt",
       .options = {{"model", std::string("5-wireless")}, {"hand", std::string("left")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      {.name = "fivedt-16",
       .driver = "fivedt",
       .options = {{"model", std::string("16")}, {"hand", std::string("right")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      {.name = "fivedt-ultra-wireless",
       .driver = "fivedt",
       .options = {{"model", std::string("ultra-wireless")}, {"hand", std::string("right")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      {.name = "fivedt-ultra-usb-5",
       .driver = "fivedt",
       .options = {{"model", std::string("ultra-usb-5")}, {"hand", std::string("left")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .whole_reports = true},
      {.name = "fivedt-ultra-usb-14",
       .driver = "fivedt",
       .options = {{"model", std::string("ultra-usb-14")}, {"hand", std::string("right")}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .whole_reports = true},
      {.name = "labels", .driver = "labels", .options = {}, .loop_chunks = 1, .chunk_frames = 1},
      {.name = "lucidgloves-alpha",
       .driver = "lucidgloves",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      {.name = "lucidgloves-legacy",
       .driver = "lucidgloves",
       .options = {{"encoding", std::string("legacy")},
                   {"hand", std::string("left")},
                   {"max_analog_value", std::int64_t{1023}}},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true},
      // More datagrams than its window of late ones, so that the loop is taken for a restart.
      {.name = "mocopi",
       .driver = "mocopi",
       .options = {},
       .loop_chunks = 80,
       .chunk_frames = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "natnet",
       .driver = "natnet",
       .options = {},
       .loop_chunks = 72,  // a step back by more than 64 frames is a restart, not a late frame
       .chunk_frames = 2,
       .chunk_samples = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "mvn",
       .driver = "mvn",
       .options = {{"rate_hz", 100.0},
                   {"types", std::string("02")},
                   {"characters", std::int64_t{1}},
                   {"datagram_bytes", std::int64_t{4096}}},
       .loop_chunks = 72,
       .chunk_frames = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "p5",
       .driver = "p5",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .whole_reports = true},
      {.name = "posed",
       .driver = "posed",
       .options = {},
       .loop_chunks = 72,  // a step back by more than 64 frames is a restart, not a late frame
       .chunk_frames = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "rokoko",
       .driver = "rokoko",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 3,
       .chunk_samples = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "rokoko-v2",
       .driver = "rokoko",
       .options = {{"version", std::string("2")}, {"lz4", false}},
       .loop_chunks = 24,
       .chunk_frames = 3,
       .chunk_samples = 1,
       .emulated = true,
       .datagrams = true},
      {.name = "template",
       .driver = "template",
       .options = {},
       .loop_chunks = 256,
       .chunk_frames = 1,
       .chunk_samples = 1},
      {.name = "template-mocap",
       .driver = "template_mocap",
       .options = {},
       .loop_chunks = 72,  // a step back by more than 64 frames is a restart, not a late frame
       .chunk_frames = 2,
       .emulated = true,
       .datagrams = true},
      {.name = "vmc",
       .driver = "vmc",
       .options = {},
       .loop_chunks = 24,
       .chunk_frames = 1,
       .chunk_samples = 1,
       .emulated = true,
       .datagrams = true},
  };
}

}  // namespace

const std::vector<DeviceFixture>& device_fixtures() {
  static const std::vector<DeviceFixture> all = make_specimens();
  return all;
}

drivers::Device open_device(const DeviceFixture& fixture) {
  if (fixture.emulated) return open_emulated(fixture);
  drivers::TransportFactory ports;
  const drivers::Driver* driver = drivers::find_driver(fixture.driver);
  REQUIRE(driver != nullptr);
  auto device = driver->open(fixture.options, ports);
  if (!device) FAIL(device.error().text());
  return std::move(*device);
}

const drivers::SourceLayout* layout_of(const DeviceFixture& fixture) {
  static std::map<std::string, std::unique_ptr<const drivers::SourceLayout>> made;
  const drivers::Driver* driver = drivers::find_driver(fixture.driver);
  REQUIRE(driver != nullptr);
  if (driver->make_layout == nullptr) return nullptr;
  auto& layout = made[fixture.name];
  if (layout == nullptr) layout = emulated_layout(fixture);
  return layout.get();
}

std::unique_ptr<drivers::Decoder> new_decoder(const DeviceFixture& fixture,
                                              const drivers::Description& description) {
  auto decoder = drivers::find_driver(description.driver)->make_decoder(description);
  if (!decoder) FAIL(decoder.error().text());
  const auto* layout = layout_of(fixture);
  if (layout != nullptr) (*decoder)->use(*layout);
  return std::move(*decoder);
}

std::vector<Bytes> read_chunks(drivers::Transport& transport, std::size_t count) {
  REQUIRE(transport.start(0));
  std::vector<Bytes> chunks;
  while (chunks.size() < count) {
    const drivers::Chunk chunk = transport.read(transport.next_due_ns());
    REQUIRE_FALSE(chunk.end);
    REQUIRE_FALSE(chunk.bytes.empty());
    chunks.emplace_back(chunk.bytes.begin(), chunk.bytes.end());
  }
  return chunks;
}

std::filesystem::path scratch_file(const std::string& name, const std::string& text) {
  static const ScratchFolder folder;
  const auto path = folder.path / name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

std::string small_bvh() {
  return "HIERARCHY\n"
         "ROOT Reference\n"
         "{\n"
         "  OFFSET 0 0 0\n"
         "  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
         "  JOINT Hips\n"
         "  {\n"
         "    OFFSET 0 90 0\n"
         "    CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
         "    JOINT Head\n"
         "    {\n"
         "      OFFSET 0 60 0\n"
         "      CHANNELS 3 Zrotation Xrotation Yrotation\n"
         "      End Site\n"
         "      {\n"
         "        OFFSET 0 20 0\n"
         "      }\n"
         "    }\n"
         "  }\n"
         "}\n"
         "MOTION\n"
         "Frames: 5\n"
         "Frame Time: 0.0083333\n"
         "0 0 0 0 0 0 1 95 0 10 -20 30 1.5 2.5 3.5\n"
         "0 0 0 0 0 0 1 95 2 11 -21 31 1.6 2.4 3.4\n"
         "0 0 0 0 0 0 1 95 4 12 -22 32 1.7 2.3 3.3\n"
         "0 0 0 0 0 0 1 95 6 13 -23 33 1.8 2.2 3.2\n"
         "0 0 0 0 0 0 1 95 8 14 -24 34 1.9 2.1 3.1\n";
}

std::string small_asf() {
  return ":version 1.10\n"
         ":name small\n"
         ":units\n"
         "  mass 1.0\n"
         "  length 0.45\n"
         "  angle deg\n"
         ":root\n"
         "  order TX TY TZ RX RY RZ\n"
         "  axis XYZ\n"
         "  position 0 0 0\n"
         "  orientation 0 0 0\n"
         ":bonedata\n"
         "  begin\n"
         "    id 1\n"
         "    name lhipjoint\n"
         "    direction 0.6 -0.8 0\n"
         "    length 2\n"
         "    axis 0 0 0 XYZ\n"
         "  end\n"
         "  begin\n"
         "    id 2\n"
         "    name lfemur\n"
         "    direction 0 -1 0\n"
         "    length 7\n"
         "    axis 0 0 20 XYZ\n"
         "    dof rx ry rz\n"
         "    limits (-160.0 20.0)\n"
         "           (-70.0 70.0)\n"
         "           (-60.0 70.0)\n"
         "  end\n"
         "  begin\n"
         "    id 3\n"
         "    name ltibia\n"
         "    direction 0 -1 0\n"
         "    length 7\n"
         "    axis 0 0 20 XYZ\n"
         "    dof rx\n"
         "    limits (-10.0 170.0)\n"
         "  end\n"
         ":hierarchy\n"
         "  begin\n"
         "    root lhipjoint\n"
         "    lhipjoint lfemur\n"
         "    lfemur ltibia\n"
         "  end\n";
}

std::string small_amc() {
  std::string text = "#!OML:ASF small\n:FULLY-SPECIFIED\n:DEGREES\n";
  for (int i = 1; i <= 5; ++i) {
    const std::string n = std::to_string(i);
    text += n + "\nroot 1." + n + " 15 " + n + " 5 4 " + n + "\nlfemur 10." + n +
            " -5 6\nltibia 2" + n + "\n";
  }
  return text;
}

std::string small_hand_csv() {
  std::string text = "time_s";
  for (const std::string finger : {"thumb", "index", "middle", "ring", "little"}) {
    for (const std::string joint : {"1", "2", "3"}) {
      for (const std::string axis : {"x", "y", "z"})
        text += "," + finger + joint + "_" + axis + "_rad";
    }
  }
  for (int i = 0; i < 5; ++i) {
    text += "\n" + std::to_string(i / 50.0);
    for (int k = 0; k < 45; ++k) text += "," + std::to_string(0.01 * k * (i + 1));
  }
  return text + "\n";
}

}  // namespace posed::test
