#include "tests/unit/drivers/emulated.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "drivers/glove/glove_emulator.hpp"
#include "drivers/transport/file.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::test {
namespace {

constexpr std::size_t kRounds = 4;  // the most rounds that the capability tests read

const drivers::Driver& driver_of(const DeviceFixture& fixture) {
  const drivers::Driver* driver = drivers::find_driver(fixture.driver);
  REQUIRE(driver != nullptr);
  REQUIRE(driver->emulate != nullptr);
  return *driver;
}

drivers::Description promised(const DeviceFixture& fixture) {
  auto description = driver_of(fixture).expect(fixture.options);
  if (!description) FAIL(description.error().text());
  return std::move(*description);
}

// Writes a description, which may have several lines, as `text` lines.
std::string text_lines(const std::string& text) {
  std::string lines = "text ";
  for (const char c : text) lines += c == '\n' ? std::string("\ntext ") : std::string(1, c);
  return lines + '\n';
}

std::string log_line(std::int64_t at_ns, std::span<const std::byte> bytes) {
  std::string line = "at " + std::to_string(at_ns) + " hex";
  for (const std::byte byte : bytes) {
    std::array<char, 8> hex{};
    (void)std::snprintf(hex.data(), hex.size(), " %02x", std::to_integer<unsigned>(byte));
    line += hex.data();
  }
  return line + '\n';
}

// Poses all bodies; the motion repeats after a loop.
void pose(const DeviceFixture& fixture, std::size_t index, drivers::Emulator& emulator) {
  if (driver_of(fixture).glove != nullptr) {
    emulator.pose(0, drivers::glove::hand_frame(closing_hand(index, fixture.loop_chunks)));
    return;
  }
  const double turn = 2.0 * std::numbers::pi * static_cast<double>(index % fixture.loop_chunks) /
                      static_cast<double>(fixture.loop_chunks);
  for (std::size_t body = 0; body < fixture.chunk_frames; ++body) {
    const double angle_rad = 0.5 * std::sin(turn + static_cast<double>(body));
    Frame frame;
    frame.joint_count = kMaxJoints;
    frame.valid.set();
    frame.rotation_xyzw.fill(from_eigen(axis_rotation(Axis::kX, angle_rad)));
    frame.root_position_m = {static_cast<float>(angle_rad), 1.0F, static_cast<float>(body)};
    emulator.pose(body, frame);
  }
}

// The description that a decoder makes of a datagram; empty when it makes none.
Bytes description_in(drivers::Decoder& decoder, const Bytes& datagram) {
  // The address sanitizer touches all of a sink's room each time.
  CollectSink sink(/*room=*/0);
  decoder.feed(datagram, 0, sink);
  return sink.described;
}

}  // namespace

HandAngles closing_hand(std::size_t index, std::size_t count) {
  HandAngles angles{};
  const double turn =
      2.0 * std::numbers::pi * static_cast<double>(index % count) / static_cast<double>(count);
  for (std::size_t f = 0; f < kFingers; ++f) {
    const double closed = 0.5 - 0.5 * std::cos(turn + 0.4 * static_cast<double>(f));
    for (std::size_t j = 0; j < kFingerJoints; ++j) {
      angles[f * kFingerChannels + 3 * j] = closed * (f == 0 && j == 0 ? 0.0 : 1.0);
    }
    angles[f * kFingerChannels + 1] = 0.2 * (1.0 - closed);
    if (f == 0) angles[2] = 0.75 * closed;  // a thumb that bends goes across the palm
  }
  return angles;
}

std::vector<std::pair<std::int64_t, Bytes>> emulated_chunks(const DeviceFixture& fixture,
                                                            std::size_t rounds) {
  auto emulator = driver_of(fixture).emulate(fixture.options);
  if (!emulator) FAIL(emulator.error().text());
  std::vector<std::pair<std::int64_t, Bytes>> chunks;
  Bytes answer;
  (*emulator)->receive(std::as_bytes(std::span(fixture.start)), 0, answer);
  // One decoder for all: some describe the bodies by themselves when they see the first frame.
  const auto decoder = driver_of(fixture).make_decoder(promised(fixture)).value();
  while (chunks.size() < rounds * fixture.loop_chunks) {
    const std::int64_t due_ns = (*emulator)->next_due_ns();
    REQUIRE(due_ns != kNoTime_ns);
    pose(fixture, chunks.size(), **emulator);
    Bytes chunk;
    (*emulator)->emit(due_ns, chunk);
    REQUIRE_FALSE(chunk.empty());
    if (!fixture.datagrams || description_in(*decoder, chunk).empty()) {
      chunks.emplace_back(due_ns, std::move(chunk));
    }
  }
  return chunks;
}

std::unique_ptr<const drivers::SourceLayout> emulated_layout(const DeviceFixture& fixture) {
  const auto emulator = driver_of(fixture).emulate(fixture.options).value();
  // One decoder for all: some describe the bodies themselves, after several frames.
  const auto decoder = driver_of(fixture).make_decoder(promised(fixture)).value();
  CollectSink sink;
  for (;;) {
    Bytes chunk;
    const std::int64_t due_ns = emulator->next_due_ns();
    emulator->emit(due_ns, chunk);
    decoder->feed(chunk, due_ns, sink);
    if (sink.described.empty()) continue;
    auto layout = driver_of(fixture).make_layout(sink.described);
    if (!layout) FAIL(layout.error().text());
    return std::move(*layout);
  }
}

drivers::Device open_emulated(const DeviceFixture& fixture) {
  drivers::Chunks chunks;
  for (const auto& [due_ns, bytes] : emulated_chunks(fixture, kRounds)) chunks.add(bytes);
  auto transport = drivers::FileTransport::open(std::move(chunks), {.rate_hz = 100.0, .pace = 0.0});
  if (!transport) FAIL(transport.error().text());
  drivers::Description description = promised(fixture);
  auto decoder = new_decoder(fixture, description);
  return {.description = std::move(description),
          .transport = std::move(*transport),
          .decoder = std::move(decoder),
          .warnings = {}};
}

std::string emulated_log(const DeviceFixture& fixture) {
  const drivers::Description description = promised(fixture);
  std::string text = "# Not a recording: made by posed's emulator of this glove (" + fixture.name +
                     "), with damage put in.\n# A real log takes its place as soon as somebody "
                     "sends one (drivers/README.md).\ndriver " +
                     description.driver + "\nidentity emulated\n" + text_lines(description.text);
  std::size_t index = 0;
  for (auto& [due_ns, bytes] : emulated_chunks(fixture, 1)) {
    switch (index++) {
      case 2:  // a byte is lost
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2));
        break;
      case 5:  // a bit flips
        bytes[bytes.size() / 3] ^= std::byte{0x40};
        break;
      case 8:  // half of it is missing
        bytes.resize(bytes.size() / 2);
        break;
      case 11:  // garbage is inserted before it
        bytes.insert(bytes.begin(), 7, std::byte{0xEE});
        break;
      default:
        break;
    }
    text += log_line(due_ns, bytes);
  }
  return text;
}

// unit_drivers [.write-logs] writes the logs that do not exist yet; with UPDATE_EXPECTED=1
// recorded_log_test writes their expected output.
TEST_CASE("write the logs of emulated gloves", "[.write-logs]") {
  for (const DeviceFixture& fixture : device_fixtures()) {
    if (!fixture.emulated || driver_of(fixture).glove == nullptr) continue;  // they write their own
    const auto path = golden("devices") / (fixture.name + ".log");
    if (!std::filesystem::exists(path)) std::ofstream(path) << emulated_log(fixture);
  }
}

}  // namespace posed::test
