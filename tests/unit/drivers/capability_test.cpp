// The properties that every driver in the registry must have, tested on a fixture of each.
#include <catch2/catch.hpp>

#include <random>
#include <set>

#include "drivers/transport/transport_factory.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/seeds.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/device_fixtures.hpp"

namespace posed::drivers {
namespace {

using test::Bytes;
using test::CollectSink;
using test::DeviceFixture;
using test::new_decoder;

Bytes joined(const std::vector<Bytes>& chunks) {
  Bytes all;
  for (const Bytes& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
  return all;
}

// `bytes` cut at random into pieces of up to `longest` bytes, as a serial port would.
void feed_in_pieces(Decoder& decoder, std::span<const std::byte> bytes, std::size_t longest,
                    std::mt19937& random, Sink& sink) {
  while (!bytes.empty()) {
    const std::size_t length = std::min(bytes.size(), 1 + random() % longest);
    decoder.feed(bytes.first(length), 0, sink);
    bytes = bytes.subspan(length);
  }
}

// What a decoder gets at once: a byte stream in one piece, datagrams one by one.
std::vector<Bytes> delivered(const DeviceFixture& fixture, const std::vector<Bytes>& chunks) {
  return fixture.datagrams ? chunks : std::vector<Bytes>{joined(chunks)};
}

void feed_all(Decoder& decoder, const std::vector<Bytes>& pieces, Sink& sink) {
  for (const Bytes& piece : pieces) decoder.feed(piece, 0, sink);
}

// A byte stream in pieces of any size; datagrams whole.
void feed_cut(const DeviceFixture& fixture, Decoder& decoder, const std::vector<Bytes>& chunks,
              std::mt19937& random, Sink& sink) {
  constexpr std::size_t kMaxLength = 300;
  if (fixture.datagrams) return feed_all(decoder, chunks, sink);
  feed_in_pieces(decoder, joined(chunks), kMaxLength, random, sink);
}

void check_same(const CollectSink& got, const CollectSink& expected) {
  CHECK(got.outcomes == expected.outcomes);
  CHECK(got.bodies == expected.bodies);
  REQUIRE(got.frames.size() == expected.frames.size());
  REQUIRE(got.samples.size() == expected.samples.size());
  for (std::size_t i = 0; i < got.frames.size(); ++i) {
    CHECK(test::same_pose(got.frames[i], expected.frames[i]));
    CHECK(got.frames[i].header.device_ns == expected.frames[i].header.device_ns);
  }
  for (std::size_t i = 0; i < got.samples.size(); ++i) {
    CHECK(test::same_values(got.samples[i], expected.samples[i]));
    CHECK(got.samples[i].header.device_ns == expected.samples[i].header.device_ns);
  }
}

// Checks all frames and samples. Device times never decrease: a repeated packet, and the first one
// after a device restart, keep the previous time.
void check_valid(const CollectSink& sink) {
  bool valid = true;
  std::int64_t before_ns = kNoTime_ns;
  for (const Frame& frame : sink.frames) {
    const std::int64_t device_ns = frame.header.device_ns;
    valid = valid && test::is_valid(frame) && device_ns >= before_ns;
    before_ns = device_ns;
  }
  for (const Sample& sample : sink.samples) valid = valid && test::is_valid(sample);
  CHECK(valid);
}

}  // namespace

TEST_CASE("every driver of the registry has a fixture, a summary and help for its options") {
  std::set<std::string_view> names;
  for (const Driver& driver : registry()) {
    INFO(driver.name);
    CHECK(names.insert(driver.name).second);
    CHECK(find_driver(driver.name) == &driver);
    CHECK_FALSE(driver.summary.empty());
    for (const OptionSpec& option : driver.options) CHECK_FALSE(option.help.empty());
    CHECK(std::ranges::count(test::device_fixtures(), driver.name, &DeviceFixture::driver) > 0);
  }
  CHECK(find_driver("no such driver") == nullptr);
}

TEST_CASE("a chunk is decoded at once and completely, and every loop equals the one before") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    const auto chunks = test::read_chunks(*device.transport, 3 * fixture.loop_chunks);
    CollectSink sink;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      device.decoder->feed(chunks[i], 0, sink);
      CHECK(sink.frames.size() == (i + 1) * fixture.chunk_frames);
      CHECK(sink.samples.size() == (i + 1) * fixture.chunk_samples);
    }
    CHECK(sink.count(Outcome::kOk) == static_cast<int>(chunks.size() * fixture.chunk_packets));
    check_valid(sink);
    const std::size_t loop = fixture.loop_chunks * fixture.chunk_frames;
    for (std::size_t i = loop; i < sink.frames.size(); ++i) {
      CHECK(test::same_pose(sink.frames[i], sink.frames[i - loop]));
      if (sink.frames[i].header.device_ns == kNoTime_ns) continue;
      const auto step_ns =
          sink.frames[i].header.device_ns - sink.frames[i - fixture.chunk_frames].header.device_ns;
      CHECK(seconds(step_ns) == Approx(1.0 / device.description.rate_hz).margin(1e-6));
    }
    const std::size_t round = fixture.loop_chunks * fixture.chunk_samples;
    for (std::size_t i = round; i < sink.samples.size(); ++i) {
      CHECK(test::same_values(sink.samples[i], sink.samples[i - round]));
    }
  }
}

TEST_CASE("frames and samples match the description") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    CollectSink sink;
    for (const Bytes& chunk : test::read_chunks(*device.transport, fixture.loop_chunks)) {
      device.decoder->feed(chunk, 0, sink);
    }
    const Description& description = device.description;
    CHECK(description.driver == fixture.driver);
    CHECK(description.samples.names.size() == description.samples.units.size());
    const SourceLayout* layout = test::layout_of(fixture);
    for (std::size_t i = 0; i < sink.frames.size(); ++i) {
      const auto& skeleton =
          layout != nullptr ? layout->bodies[sink.bodies[i]].skeleton : description.skeleton;
      REQUIRE(skeleton != nullptr);
      CHECK(sink.frames[i].skeleton == skeleton->id);
      CHECK(sink.frames[i].joint_count == skeleton->joints.size());
    }
    for (std::size_t i = 0; i < sink.samples.size(); ++i) {
      const SampleLayout& samples =
          layout != nullptr ? layout->bodies[sink.sample_bodies[i]].samples : description.samples;
      CHECK(sink.samples[i].value_count == samples.names.size());
      CHECK(samples.names.size() == samples.units.size());
    }
  }
}

TEST_CASE("the same bytes in any chunks give the same frames") {
  std::mt19937 random(7);
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    if (fixture.datagrams) continue;  // the network does not cut them
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    const Bytes bytes = joined(test::read_chunks(*device.transport, 2 * fixture.loop_chunks));
    CollectSink whole;
    device.decoder->feed(bytes, 0, whole);
    CHECK(whole.frames.size() == 2 * fixture.loop_chunks * fixture.chunk_frames);
    for (const std::size_t longest : {1U, 2U, 7U, 100U, 1000U}) {
      CollectSink cut;
      feed_in_pieces(*new_decoder(fixture, device.description), bytes, longest, random, cut);
      check_same(cut, whole);
    }
  }
}

TEST_CASE("a log's text and identity build the same device again") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    const Description& live = device.description;
    const auto again = find_driver(live.driver)->describe(live.text, live.identity);
    if (!again) FAIL(again.error().text());
    CHECK(again->driver == live.driver);
    CHECK(again->text == live.text);
    CHECK(again->identity == live.identity);
    CHECK(again->rate_hz == live.rate_hz);
    CHECK(again->samples.names == live.samples.names);
    CHECK(again->samples.units == live.samples.units);
    REQUIRE((again->skeleton == nullptr) == (live.skeleton == nullptr));
    if (live.skeleton) {
      CHECK(again->skeleton->id == live.skeleton->id);
      CHECK(again->skeleton->root_joint == live.skeleton->root_joint);
    }
    CollectSink here;
    CollectSink there;
    const auto decoder = new_decoder(fixture, *again);
    for (const Bytes& chunk : test::read_chunks(*device.transport, fixture.loop_chunks)) {
      device.decoder->feed(chunk, 0, here);
      decoder->feed(chunk, 0, there);
    }
    check_same(there, here);
  }
}

TEST_CASE("a damaged description is refused with an error message, never a crash") {
  std::mt19937 random(11);
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    const Device device = test::open_device(fixture);
    const Driver& driver = *find_driver(fixture.driver);
    CHECK_FALSE(driver.describe("", "x"));
    CHECK_FALSE(driver.describe("foreign", "x"));
    for (int i = 0; i < 500; ++i) {
      std::string text =
          device.description.text.substr(0, random() % device.description.text.size());
      for (int flips = 0; flips < i % 3 && !text.empty(); ++flips) {
        text[random() % text.size()] = static_cast<char>(random());
      }
      const auto description = driver.describe(text, "x");
      if (description) continue;  // the missing or changed part may be optional
      CHECK_FALSE(description.error().message.empty());
      CHECK(description.error().message.find('\n') == std::string::npos);
    }
  }
}

TEST_CASE("garbage and flipped bytes are counted, never a crash or an invalid pose") {
  std::mt19937 random(13);
  CollectSink sink;
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    const auto good = test::read_chunks(*device.transport, fixture.loop_chunks);
    for (int round = 0; round < (test::few_seeds() ? 50 : 200); ++round) {
      const auto decoder = new_decoder(fixture, device.description);
      sink.clear();
      std::vector<Bytes> bad = good;
      for (int flips = 0; flips <= round % 20; ++flips) {
        Bytes& chunk = bad[random() % bad.size()];
        chunk[random() % chunk.size()] = static_cast<std::byte>(random());
      }
      feed_cut(fixture, *decoder, bad, random, sink);
      Bytes noise(random() % 3000);
      for (std::byte& byte : noise) byte = static_cast<std::byte>(random());
      feed_in_pieces(*decoder, noise, 300, random, sink);
      check_valid(sink);
      // The decoder resynchronises: of two more loops the second is decoded completely.
      feed_cut(fixture, *decoder, good, random, sink);
      sink.clear();
      feed_cut(fixture, *decoder, good, random, sink);
      CHECK(sink.frames.size() == fixture.loop_chunks * fixture.chunk_frames);
    }
  }
}

TEST_CASE("input without an end is given up, and the stream goes on after it") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    CollectSink sink;
    const Bytes endless(3 * kMaxChunk, std::byte{'7'});
    device.decoder->feed(endless, 0, sink);
    CHECK(sink.frames.empty());
    int counted = 0;
    for (const int count : sink.outcomes) counted += count;
    CHECK(counted >= 1);
    CHECK(counted < 10);
    sink.clear();
    const auto chunks = test::read_chunks(*device.transport, fixture.loop_chunks);
    for (const Bytes& chunk : chunks) device.decoder->feed(chunk, 0, sink);
    CHECK(sink.frames.size() + 1 >= chunks.size() * fixture.chunk_frames);
  }
}

TEST_CASE("decoding does not allocate, whatever the bytes are") {
  const std::uint64_t start = test::allocations();
  int* volatile seen = new int(1);  // volatile, so that the compiler does not remove it
  delete seen;
  REQUIRE(test::allocations() > start);  // the counter works
  std::mt19937 random(17);
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    const auto good = delivered(fixture, test::read_chunks(*device.transport, fixture.loop_chunks));
    auto bad = good;
    for (int flips = 0; flips < 20; ++flips) {
      Bytes& piece = bad[random() % bad.size()];
      piece[random() % piece.size()] ^= std::byte{0x55};
    }
    CollectSink sink;
    const std::uint64_t before = test::allocations();
    feed_all(*device.decoder, good, sink);
    feed_all(*device.decoder, bad, sink);
    feed_all(*device.decoder, good, sink);
    CHECK(test::allocations() == before);
    CHECK_FALSE(sink.frames.empty());
  }
}

TEST_CASE("reading does not allocate") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    INFO(fixture.name);
    Device device = test::open_device(fixture);
    (void)test::read_chunks(*device.transport, 1);
    const std::uint64_t before = test::allocations();
    for (int i = 0; i < 1000; ++i) static_cast<void>(device.transport->read(0));
    CHECK(test::allocations() == before);
  }
}

TEST_CASE("wrong options are refused with an error message that names them") {
  TransportFactory ports;
  for (const Driver& driver : registry()) {
    INFO(driver.name);
    const auto unknown = driver.open({{"no_such_option", true}}, ports);
    REQUIRE_FALSE(unknown);
    CHECK(unknown.error().message.find("no_such_option") != std::string::npos);
    CHECK(unknown.error().exit_code == ExitCode::kWrongUse);
    for (const OptionSpec& option : driver.options) {
      const bool is_bool = std::holds_alternative<bool>(option.default_value);
      const OptionValue wrong = is_bool ? OptionValue(std::string("x")) : OptionValue(true);
      Options options{{"path", std::string("x")}};
      options[std::string(option.name)] = wrong;
      const auto device = driver.open(options, ports);
      REQUIRE_FALSE(device);
      CHECK(device.error().exit_code == ExitCode::kWrongUse);
    }
  }
}

// A stream whose device may be connected later is opened by its supervisor, long after the start,
// so mistakes in its options must be found without opening it.
TEST_CASE("what open() would refuse as wrong use, expect() refuses with the same message") {
  const std::vector<std::pair<std::string, OptionValue>> wrong_values{
      {"hand", std::string("middle")},
      {"link", std::string("bluetooth")},
      {"baud", std::int64_t{-1}},
      {"baud", std::int64_t{5'000'000}},
      {"model", std::string("17")},
      {"encoding", std::string("morse")},
      {"form", std::string("9bit")},
      {"rate_hz", -1.0},
      {"poll_hz", std::int64_t{1000}},
      {"max_analog_value", std::int64_t{0}},
      {"kit_port", std::string("c")},
      {"mode", std::string("wait")},
      {"device", std::string("nothing.toml")}};
  int refused = 0;
  const auto compare = [&](const Driver& driver, const Options& options) {
    TransportFactory ports;
    ports.cancel();  // open() does not wait
    const auto opened = driver.open(options, ports);
    if (opened || opened.error().exit_code != ExitCode::kWrongUse) return;
    const auto expected = driver.expect(options);
    INFO(driver.name << ": " << opened.error().text());
    REQUIRE_FALSE(expected);
    CHECK(expected.error().text() == opened.error().text());
    CHECK(expected.error().exit_code == ExitCode::kWrongUse);
    ++refused;
  };
  for (const Driver& driver : registry()) {
    if (driver.expect == nullptr) continue;
    Options required;
    if (driver.name == "described") required["device"] = std::string("opencyberglove");
    for (const auto& [name, value] : wrong_values) {
      if (std::ranges::find(driver.options, name, &OptionSpec::name) == driver.options.end()) {
        continue;
      }
      Options options = required;
      options[name] = value;
      compare(driver, options);
    }
    for (const char* endpoint : {"nonsense", "0.0.0.0:5200"}) {
      if (std::ranges::find(driver.options, "link", &OptionSpec::name) == driver.options.end()) {
        continue;
      }
      compare(driver, {{"link", std::string("tcp")}, {"listen", std::string(endpoint)}});
    }
  }
  CHECK(refused >= 20);
}

}  // namespace posed::drivers
