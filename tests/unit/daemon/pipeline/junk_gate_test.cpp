// What a recording takes of a flood of rubbish: the first of it, a small share of the rest, and all
// that comes from others.
#include <catch2/catch.hpp>

#include "daemon/pipeline/junk_gate.hpp"
#include "daemon/pipeline/reader.hpp"
#include "tests/support/ms.hpp"
#include "tests/support/quiet_record_sink.hpp"

namespace posed::pipeline {
namespace {

std::int64_t junk_now_ns = 1'000'000'000;
std::int64_t junk_clock() noexcept { return junk_now_ns; }

constexpr std::size_t kHonestBytes = 100, kJunkBytes = 60'000;

// Each read gives one datagram: twenty of rubbish, of a new sender each, for one of the device.
class Flooded final : public drivers::Transport {
 public:
  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override { return junk_now_ns; }
  Result<> start(std::int64_t) override { return {}; }
  [[nodiscard]] drivers::Chunk read(std::int64_t) noexcept override {
    const bool honest = ++count_ % 21 == 0;
    return {.bytes = std::span(bytes_).first(honest ? kHonestBytes : kJunkBytes),
            .sender = honest ? 1U : 1'000U + count_};
  }
  [[nodiscard]] bool send(std::span<const std::byte>, std::uint8_t) noexcept override {
    return false;
  }

 private:
  std::array<std::byte, kJunkBytes> bytes_{};
  std::uint64_t count_ = 0;
};

struct SizeDecoder final : drivers::Decoder {
  void feed(std::span<const std::byte> bytes, std::int64_t, Sink& sink) noexcept override {
    fed.push_back(bytes.size());
    sink.outcome(bytes.size() == kHonestBytes ? Outcome::kOk : Outcome::kShort);
  }
  std::vector<std::size_t> fed;
};

struct SizeRecord final : test::QuietRecordSink {
  void chunk(std::uint32_t, std::uint8_t, Direction direction, std::int64_t, const Position&,
             std::span<const std::byte> bytes) noexcept override {
    if (direction == Direction::kFromDevice) recorded.push_back(bytes.size());
  }
  std::vector<std::size_t> recorded;
};

struct FloodedReader {
  explicit FloodedReader(RecordSink* record) {
    device.transport = std::make_unique<Flooded>();
    auto made = std::make_unique<SizeDecoder>();
    decoder = made.get();
    device.decoder = std::move(made);
    reader = Reader::open({.out = &decoded,
                           .pipeline = wake.get(),
                           .record_sink = record,
                           .clock = junk_clock,
                           .commands = nullptr})
                 .value();
    reader->add({.device = &device, .counters = &counters});
    reader->begin();
  }
  // `datagrams` of rubbish and the device's in a second.
  void run(int seconds, int datagrams) {
    for (int i = 0; i < seconds * datagrams; ++i) {
      junk_now_ns += kNanosPerSecond / datagrams;
      static_cast<void>(reader->turn(junk_now_ns));
    }
  }

  drivers::Device device;
  SizeDecoder* decoder = nullptr;
  Ring<Item> decoded{64};
  SourceCounters counters;
  std::unique_ptr<system::EventFd> wake = system::EventFd::open().value();
  std::unique_ptr<Reader> reader;
};

std::size_t count_of(const std::vector<std::size_t>& sizes, std::size_t size) {
  return static_cast<std::size_t>(std::ranges::count(sizes, size));
}

}  // namespace

TEST_CASE("of a flood of rubbish little is recorded, and of the device everything") {
  constexpr int kSeconds = 10, kPerSecond = 2100;
  SizeRecord record;
  FloodedReader flooded(&record);
  flooded.run(kSeconds, kPerSecond);
  const std::size_t fed = flooded.decoder->fed.size();
  REQUIRE(fed > 1000);
  CHECK(flooded.decoder->fed == record.recorded);  // or a replay would not do the same
  const std::size_t junk = count_of(record.recorded, kJunkBytes) * kJunkBytes;
  CHECK(junk > 1'000'000);
  CHECK(junk < kSeconds * 1'000'000);
  const auto outcome = [&](Outcome one) {
    return flooded.counters.outcome[static_cast<std::size_t>(one)].load();
  };
  CHECK(outcome(Outcome::kOk) >= 990);  // 1,000 came
  CHECK(outcome(Outcome::kShort) + outcome(Outcome::kForeign) > 19'000);
}

TEST_CASE("without a recording everything is decoded") {
  FloodedReader flooded(nullptr);
  flooded.run(2, 2100);
  CHECK(count_of(flooded.decoder->fed, kJunkBytes) == 4200);
}

TEST_CASE("a sender is known for a while, and what is not a datagram always passes") {
  using test::kMs;
  JunkGate gate;
  std::int64_t now_ns = kNanosPerSecond;
  REQUIRE(gate.admits(1, 100, now_ns));
  gate.decoded(1, true, 100, now_ns);
  for (int i = 0; i < 20; ++i) gate.decoded(2, false, 60'000, now_ns);
  CHECK(gate.admits(1, 100, now_ns));
  CHECK_FALSE(gate.admits(2, 100, now_ns));
  CHECK_FALSE(gate.admits(3, 100, now_ns));
  CHECK(gate.admits(0, 100, now_ns));
  for (int i = 0; i < 1000; ++i) gate.decoded(0, false, 60'000, now_ns);
  CHECK(gate.admits(0, 100, now_ns));
  now_ns += JunkGate::kKnownFor_ns + kMs;
  REQUIRE(gate.admits(2, 100, now_ns));
  for (int i = 0; i < 20; ++i) gate.decoded(2, false, 60'000, now_ns);
  CHECK_FALSE(gate.admits(1, 100, now_ns));
}

// A device that reconnects while a flood of links has used up what may be recorded.
TEST_CASE("a link is heard without a gap from its first byte to its end, or not at all") {
  using test::kMs;
  constexpr std::int64_t kRead = 4096;
  JunkGate gate;
  std::int64_t now_ns = kNanosPerSecond, junk = 0;
  int let_in = 0;
  for (std::uint64_t link = 1; link <= 2000; ++link, now_ns += 10 * kMs) {
    int heard = 0, refused = 0;
    for (int i = 0; i < 100 && refused == 0; ++i) {
      if (!gate.admits_link(link, now_ns)) {
        ++refused;
      } else {
        ++heard;
        junk += kRead;
        gate.decoded(link, false, kRead, now_ns);
      }
    }
    CHECK((heard == 100 || heard == 0 || heard == JunkGate::kFirstBytes / kRead + 1));
    let_in += heard > 0 ? 1 : 0;
  }
  CHECK(let_in > 100);  // so a device that tries again is soon let in
  // In 20 s, and what was saved up or may be owed.
  CHECK(junk < 21 * JunkGate::kJunkPerSecond + 2 * JunkGate::kMaxOwed + 100 * kRead);
  // One that goes on for ever ends; one that is of use does not.
  const auto passes = [&](std::uint64_t link, bool used) {
    now_ns += 60 * kNanosPerSecond;
    std::int64_t bytes = 0;
    for (; bytes < 3 * JunkGate::kMaxOwed && gate.admits_link(link, now_ns); bytes += kRead) {
      gate.decoded(link, used, kRead, now_ns);
    }
    return bytes;
  };
  CHECK(passes(5000, false) <= JunkGate::kMaxOwed + JunkGate::kJunkPerSecond + kRead);
  CHECK(passes(5001, false) >= JunkGate::kMaxOwed);
  CHECK(passes(5002, true) >= 3 * JunkGate::kMaxOwed);
}

// Ten megabytes a second of messages that are each six reads long.
TEST_CASE("a link whose messages are long is heard after a pause, too") {
  constexpr std::int64_t kRead = 4096;
  JunkGate gate;
  std::int64_t now_ns = kNanosPerSecond;
  for (int second = 0; second < 10; ++second, now_ns += 3 * kNanosPerSecond) {
    for (int i = 0; i < 6 * 400; ++i, now_ns += kNanosPerSecond / 2400) {
      REQUIRE(gate.admits_link(1, now_ns));
      gate.decoded(1, i % 6 == 5, kRead, now_ns);
    }
  }
}

// The device's first message makes it known, however much a flood before it has owed.
TEST_CASE("a device that connects after a flood of a link is heard at once") {
  constexpr std::int64_t kRead = 4096;
  JunkGate gate;
  const std::int64_t now_ns = kNanosPerSecond;
  while (gate.admits_link(1, now_ns)) gate.decoded(1, false, kRead, now_ns);
  for (int i = 0; i < 3; ++i) {
    REQUIRE(gate.admits_link(2, now_ns));
    gate.decoded(2, i == 2, kRead, now_ns);
  }
  for (int i = 0; i < 100; ++i) {
    REQUIRE(gate.admits_link(2, now_ns));
    gate.decoded(2, false, kRead, now_ns);
  }
}

}  // namespace posed::pipeline
