#include "tests/unit/drivers/device_fixtures.hpp"

#include <catch2/catch.hpp>

#include <unistd.h>

#include <algorithm>
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

using drivers::Options;

// A glove that its driver's emulator plays; `start` are the bytes that it needs before it streams.
DeviceFixture glove(std::string name, std::string driver, Options options = {},
                    std::string start = {}) {
  return {.name = std::move(name),
          .driver = std::move(driver),
          .options = std::move(options),
          .loop_chunks = 24,
          .chunk_frames = 1,
          .chunk_samples = 1,
          .emulated = true,
          .start = std::move(start)};
}

// A system with several bodies over UDP, played by its driver's emulator.
DeviceFixture source(std::string name, std::string driver, std::size_t loop_chunks,
                     std::size_t bodies, std::size_t samples = 0, Options options = {}) {
  return {.name = std::move(name),
          .driver = std::move(driver),
          .options = std::move(options),
          .loop_chunks = loop_chunks,
          .chunk_frames = bodies,
          .chunk_samples = samples,
          .emulated = true,
          .datagrams = true};
}

// A clip of five frames.
DeviceFixture clip(std::string name, Options options) {
  options["pace"] = 0.0;
  return {.name = std::move(name),
          .driver = "file",
          .options = std::move(options),
          .loop_chunks = 5,
          .chunk_frames = 1};
}

DeviceFixture reports(DeviceFixture fixture) {
  fixture.whole_reports = true;
  return fixture;
}

DeviceFixture two_packets(DeviceFixture fixture) {
  fixture.chunk_packets = 2;
  return fixture;
}

DeviceFixture axis(std::string name, Options options) {
  DeviceFixture fixture =
      two_packets(source(std::move(name), "axis", 24, 2, 0, std::move(options)));
  fixture.datagrams = false;
  return fixture;
}

std::vector<DeviceFixture> make_specimens() {
  const std::string right = "right", left = "left";
  const auto described = [](const std::string& name, Options options, const std::string& start) {
    options["device"] = name;
    std::string fixture = "described-" + name;
    std::ranges::replace(fixture, '_', '-');
    return glove(fixture, "described", std::move(options), start);
  };
  const auto fivedt = [](const std::string& model, const std::string& hand,
                         const std::string& start = {}) {
    return glove("fivedt-" + model, "fivedt", {{"model", model}, {"hand", hand}}, start);
  };
  // A step back by more than 64 numbers is a restart, not a late datagram: the loops of numbered
  // datagrams are longer than that.
  std::vector<DeviceFixture> all{
      axis("axis", {}),
      axis("axis-text", {{"format", std::string("text")}, {"reference", true}}),
      glove("cyberglove-16bit", "cyberglove", {{"form", std::string("16bit")}},
            "1m\x03"
            "1S"),
      glove("cyberglove-18", "cyberglove",
            {{"sensors", std::int64_t{18}}, {"hand", left}, {"time", false}}, "u 1\rS"),
      glove("cyberglove-22", "cyberglove", {}, "u 1\rd 1\rt 1152 1\rS"),
      two_packets(described("bebop_forte", {}, "\xb0\x76\x01\xb0\x73\x01")),
      described("opencyberglove", {{"hand", left}}, {}),
      described("vmg30", {}, "\x24\x0a\x03\x01\x32\x23"),
      clip("file, bvh", {{"path", scratch_file("small.bvh", small_bvh()).string()}}),
      clip("file, amc", {{"path", scratch_file("01_02.amc", small_amc()).string()},
                         {"skeleton", scratch_file("small.asf", small_asf()).string()}}),
      clip("file, hand csv",
           {{"path", scratch_file("hand.csv", small_hand_csv()).string()}, {"hand", left}}),
      fivedt("5", right, "AD"),
      fivedt("5-wireless", left),
      fivedt("16", right),
      fivedt("ultra-wireless", right),
      reports(fivedt("ultra-usb-5", left)),
      reports(fivedt("ultra-usb-14", right)),
      {.name = "labels", .driver = "labels", .options = {}, .loop_chunks = 1, .chunk_frames = 1},
      source("landmarks", "landmarks", 24, 2),
      glove("lucidgloves-alpha", "lucidgloves"),
      glove("lucidgloves-legacy", "lucidgloves",
            {{"encoding", std::string("legacy")},
             {"hand", left},
             {"max_analog_value", std::int64_t{1023}}}),
      source("mocopi", "mocopi", 80, 1),
      source("natnet", "natnet", 72, 2, 1),
      source("mvn", "mvn", 72, 1, 0,
             {{"rate_hz", 100.0},
              {"types", std::string("02")},
              {"characters", std::int64_t{1}},
              {"datagram_bytes", std::int64_t{4096}}}),
      reports(glove("p5", "p5")),
      source("posed", "posed", 72, 1),
      source("rokoko", "rokoko", 24, 3, 1),
      source("rokoko-v2", "rokoko", 24, 3, 1, {{"version", std::string("2")}, {"lz4", false}}),
      source("template-mocap", "template_mocap", 72, 2),
      source("vmc", "vmc", 24, 1, 1),
  };
  // A glove that streams from power-on and sends a packet a frame needs no entry above.
  for (const drivers::Driver& driver : drivers::registry()) {
    const std::string name(driver.name);
    const bool listed = std::ranges::find(all, name, &DeviceFixture::driver) != all.end();
    if (!listed && driver.glove != nullptr && driver.emulate != nullptr) {
      all.push_back(glove(name, name));
    }
  }
  return all;
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
