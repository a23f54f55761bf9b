// Every decoder of the registry on any bytes in chunks of any size, and the device description that
// a log stores. The first byte selects the decoder, the second one how the rest is cut into chunks.
#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "drivers/driver.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "proto/frame/hand.hpp"
#include "tests/fuzz/glove_kinds.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::fuzz::demand;
using posed::fuzz::feed;
using posed::test::CollectSink;

constexpr std::string_view kBvh =
    "posed-clip bvh rate_hz=100 metres_per_unit=0.01 root_joint=0 asf_bytes=0\n"
    "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
    "Yrotation Xrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n"
    "MOTION\nFrames: 1\nFrame Time: 0.01\n0 1 0 0 0 0";
constexpr std::string_view kAsf =
    ":version 1.10\n:units\nlength 0.45\nangle deg\n:root\norder TX TY TZ RX RY RZ\naxis XYZ\n"
    "position 0 0 0\norientation 0 0 0\n:bonedata\nbegin\nid 1\nname b\ndirection 1 0 0\n"
    "length 5\naxis 0 0 20 XYZ\ndof rx ry\nend\n:hierarchy\nbegin\nroot b\nend\n";

std::string hand_description() {
  std::string text =
      "posed-clip csv rate_hz=30 metres_per_unit=0.01 root_joint=0 asf_bytes=0 "
      "hand=left shape=adult\ntime_s";
  for (const std::string_view finger : posed::kFingerNames) {
    for (const char joint : {'1', '2', '3'}) {
      for (const char axis : {'x', 'y', 'z'}) {
        text += ',' + std::string(finger) + joint + '_' + axis + "_rad";
      }
    }
  }
  return text + "\n0" + std::string(posed::kHandChannels, ',') + '\n';
}

std::string amc_description() {
  return "posed-clip amc rate_hz=120 metres_per_unit=0.056 root_joint=0 asf_bytes=" +
         std::to_string(kAsf.size()) + "\n" + std::string(kAsf) + "1\nroot 0 1 0 0 0 0\nb 1 2\n";
}

std::unique_ptr<posed::drivers::Decoder> decoder_of(const char* driver, const std::string& text) {
  const posed::drivers::Driver* found = posed::drivers::find_driver(driver);
  demand(found != nullptr);
  const auto description = found->describe(text, "fuzz");
  if (!description) return nullptr;
  auto decoder = found->make_decoder(*description);
  demand(decoder.has_value());
  return std::move(*decoder);
}

void check(const CollectSink& sink) {
  std::int64_t before_ns = posed::kNoTime_ns;
  for (const posed::Frame& frame : sink.frames) {
    const std::int64_t device_ns = frame.header.device_ns;
    demand(posed::test::is_valid(frame));
    demand(device_ns >= before_ns);
    before_ns = device_ns;
  }
  for (const posed::Sample& sample : sink.samples) demand(posed::test::is_valid(sample));
}

void try_bytes(const char* driver, const std::string& text, std::size_t piece,
               std::span<const std::byte> bytes) {
  const auto decoder = decoder_of(driver, text);
  const auto whole_decoder = decoder_of(driver, text);
  demand(decoder != nullptr);
  CollectSink whole(0);
  feed(*whole_decoder, bytes, 0, whole);
  check(whole);
  CollectSink cut(0);
  while (!bytes.empty()) {
    const std::size_t length = std::min(piece, bytes.size());
    feed(*decoder, bytes.first(length), 0, cut);
    bytes = bytes.subspan(length);
  }
  demand(cut.outcomes == whole.outcomes && cut.frames.size() == whole.frames.size() &&
         cut.samples.size() == whole.samples.size());
  for (std::size_t i = 0; i < cut.frames.size(); ++i) {
    demand(posed::test::same_pose(cut.frames[i], whole.frames[i]));
  }
}

// Two bodies, of one joint and of two, as in the drawing of drivers/template_mocap/protocol.hpp.
std::string mocap_bodies() {
  const std::string offset(12, '\0');
  const std::string hips = std::string("\4hips\xff") + offset;
  return std::string("\2\1\0\1A\1", 6) + hips + std::string("\2\0\1B\2", 5) + hips +
         std::string("\4head\0", 6) + offset;
}

// What a device with several bodies says about them first.
class FirstDescription final : public posed::Sink {
 public:
  void frame(std::size_t, posed::Frame&) noexcept override {}
  void sample(std::size_t, posed::Sample&) noexcept override {}
  void outcome(posed::Outcome) noexcept override {}
  void description(std::span<const std::byte> described) noexcept override {
    if (bytes.empty()) bytes.assign(described.begin(), described.end());
  }
  std::vector<std::byte> bytes;
};

// Any driver for several bodies: with the bodies of its own emulator, the bytes are one more packet
// from it, and a description.
void try_bodies(const posed::drivers::Driver& driver, std::span<const std::byte> bytes) {
  const std::string name(driver.name);
  const auto emulator = driver.emulate({});
  const auto device = driver.expect({});
  demand(emulator.has_value() && device.has_value());
  const auto decoder = decoder_of(name.c_str(), device->text);
  demand(decoder != nullptr);
  FirstDescription first;
  for (int i = 0; i < 100 && first.bytes.empty(); ++i) {
    std::vector<std::byte> packet;
    const std::int64_t due_ns = (*emulator)->next_due_ns();
    (*emulator)->emit(due_ns, packet);
    feed(*decoder, packet, due_ns, first);
  }
  const auto layout = driver.make_layout(first.bytes);
  demand(layout.has_value());
  decoder->use(**layout);
  CollectSink sink(0);
  feed(*decoder, bytes, 0, sink);
  for (const std::size_t body : sink.bodies) demand(body < (*layout)->bodies.size());
  for (const posed::Frame& frame : sink.frames) demand(posed::test::is_valid(frame));
  const auto any = driver.make_layout(bytes);
  if (!any) return;
  demand((*any)->bodies.size() <= posed::kMaxBodies);
  decoder->use(**any);
  feed(*decoder, bytes, 0, sink);
}

// The bytes are a datagram, a datagram's content with a right head and checksum, and a description.
void try_mocap(std::span<const std::byte> bytes) {
  const posed::drivers::Driver* driver = posed::drivers::find_driver("template_mocap");
  static const auto layout =
      driver->make_layout(std::as_bytes(std::span<const char>(mocap_bodies())));
  demand(layout.has_value());
  const auto decoder = decoder_of("template_mocap", "template_mocap rate=100");
  CollectSink sink(0);
  feed(*decoder, bytes, 0, sink);
  decoder->use(**layout);
  feed(*decoder, bytes, 0, sink);
  if (bytes.size() <= 60'000) {
    for (const auto kind :
         {posed::drivers::mocap::Kind::kDescription, posed::drivers::mocap::Kind::kFrame}) {
      feed(*decoder, posed::drivers::mocap::encode_datagram(kind, bytes), 0, sink);
    }
  }
  for (const std::size_t body : sink.bodies) demand(body < (*layout)->bodies.size());
  check(sink);
  const auto any = driver->make_layout(bytes);
  if (!any) return;
  demand((*any)->bodies.size() <= posed::kMaxBodies);
  decoder->use(**any);
  feed(*decoder, bytes, 0, sink);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span bytes = std::as_bytes(std::span(data + 2, size - 2));
  const std::size_t piece = 1U + data[1];
  const std::string text(reinterpret_cast<const char*>(data + 2), size - 2);
  switch (data[0] % 7) {
    case 0:
      try_bytes("file", std::string(kBvh), piece, bytes);
      break;
    case 1:
      try_bytes("file", amc_description(), piece, bytes);
      break;
    case 2:
      try_bytes("labels", "right 30", piece, bytes);
      (void)decoder_of("labels", text);
      break;
    case 3:
      try_bytes("file", hand_description(), piece, bytes);
      break;
    case 4:
      for (const auto& [driver, options] : posed::fuzz::glove_kinds()) {
        const std::string name(driver->name);
        try_bytes(name.c_str(), driver->expect(options).value().text, piece, bytes);
        (void)decoder_of(name.c_str(), text);
      }
      // With the geometry of a rig, which no P5 has before it is opened.
      try_bytes("p5",
                "p5 hand=right firmware=none heads=06000000004f leds=0c0000ff010c" +
                    std::string(112, '0'),
                piece, bytes);
      break;
    case 5:
      try_mocap(bytes);
      for (const posed::drivers::Driver& driver : posed::drivers::registry()) {
        if (driver.make_layout == nullptr) continue;
        try_bodies(driver, bytes);
        (void)decoder_of(std::string(driver.name).c_str(), text);
      }
      break;
    default:
      if (const auto decoder = decoder_of("file", text)) {
        CollectSink sink(0);
        feed(*decoder, bytes, 0, sink);
        check(sink);
      }
  }
  return 0;
}
