// Noise on the line, for every glove that has an emulator: one byte in a hundred is flipped,
// dropped or inserted, in two minutes of packets at 150 Hz. The damage that each framing cannot
// detect is printed.
#include <catch2/catch.hpp>

#include <cstdio>
#include <deque>
#include <random>

#include "drivers/emulate/faults.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/glove/traits.hpp"
#include "tests/support/seeds.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/decoder_of.hpp"
#include "tests/unit/drivers/emulated.hpp"

namespace posed::drivers {
namespace {

using test::Bytes;
using test::DeviceFixture;

const std::size_t kPackets = test::few_seeds() ? 3'000 : 18'000;  // two minutes, or 20 s
constexpr double kNoise = 0.01;                                   // of bytes
constexpr std::size_t kMaxLatePackets = 8;  // most packets by which a decoder's output may be late

// The largest share of damaged packets that are accepted as good, for gloves whose framing cannot
// detect all damage. Of a glove that is not listed its driver says it (GloveTraits::undetected).
struct Blind {
  std::string_view fixture;
  double most;
  const char* why;
};
constexpr std::array kBlind{
    Blind{"cyberglove-16bit", 0.3, "no checksum: the lower 12 bits of a value may flip"},
    Blind{"cyberglove-18", 0.4, "no checksum: a byte that flips to another than 0 is a value"},
    Blind{"cyberglove-22", 0.4, "no checksum: a byte that flips to another than 0 is a value"},
    Blind{"described-bebop-forte", 0.6, "nothing checks its bytes but marks and ranges"},
    Blind{"described-vmg30", 0.005, "a sum of 8 bits misses one in 256 of two faults in a packet"},
    Blind{"fivedt-16", 0.4, "no known checksum: changed low bytes are other values"},
    Blind{"fivedt-5", 0.02, "an XOR of 8 bits, and any byte 80 looks like a start"},
    Blind{"fivedt-5-wireless", 0.02, "an XOR of 8 bits, and any byte 80 looks like a start"},
    Blind{"fivedt-ultra-wireless", 0.9, "nothing checks its bytes but one mark a record"},
    Blind{"lucidgloves-alpha", 0.9, "a line of text without a checksum: other digits are a line"},
    Blind{"lucidgloves-legacy", 0.9, "a line of text without a checksum: other digits are a line"},
};

double allowed_share(const DeviceFixture& fixture) {
  const auto at = std::ranges::find(kBlind, fixture.name, &Blind::fixture);
  return at == kBlind.end() ? find_driver(fixture.driver)->glove->undetected : at->most;
}

// A sent packet, kept until it has been decoded or can no longer be.
struct Sent {
  Sample sample;
  bool whole = false;
};

struct Tally {
  std::size_t sent = 0, whole = 0;  // packets; those not touched by noise
  std::size_t whole_through = 0;    // of those
  std::size_t damaged_through = 0;  // correct in spite of the noise (a byte between packets)
  std::size_t wrong = 0;            // published as good, but never sent so
  std::size_t lost_in_a_row = 0;    // longest run of lost untouched packets
};

// Receives the glove's decoded samples and finds the packet of each.
class Judge {
 public:
  void sent(const Sample& sample, bool whole) {
    waiting_.push_back({sample, whole});
    ++tally_.sent;
    if (whole) ++tally_.whole;
    while (waiting_.size() > kMaxLatePackets) give_up();
  }
  void came(const Sample& sample) {
    const auto at = std::ranges::find_if(
        waiting_, [&](const Sent& sent) { return test::same_values(sent.sample, sample); });
    if (at == waiting_.end()) {
      ++tally_.wrong;
      return;
    }
    while (waiting_.begin() != at) give_up();
    ++(at->whole ? tally_.whole_through : tally_.damaged_through);
    lost_ = 0;
    waiting_.pop_front();
  }
  [[nodiscard]] const Tally& tally() const { return tally_; }

 private:
  void give_up() {
    lost_ = waiting_.front().whole ? lost_ + 1 : 0;
    tally_.lost_in_a_row = std::max(tally_.lost_in_a_row, lost_);
    waiting_.pop_front();
  }

  std::deque<Sent> waiting_;
  Tally tally_;
  std::size_t lost_ = 0;
};

HandAngles any_pose(std::mt19937& random) {
  HandAngles angles;
  for (double& angle : angles) angle = static_cast<double>(random() % 1024) * (1.2 / 1024.0);
  return angles;
}

Tally stream_through_noise(const DeviceFixture& fixture) {
  const auto emulator = find_driver(fixture.driver)->emulate(fixture.options);
  REQUIRE(emulator);
  const auto noisy = test::decoder_of(*find_driver(fixture.driver), fixture.options);
  const auto clean = test::decoder_of(*find_driver(fixture.driver), fixture.options);
  emulate::FaultInjector line({emulate::FaultKind::kNoise, kNoise}, 3);
  std::mt19937 random(5);
  Judge judge;
  test::CollectSink truth(8);
  test::CollectSink got(64);
  Bytes packet, arrived;
  (*emulator)->receive(std::as_bytes(std::span(fixture.start)), 0, packet);
  for (std::size_t i = 0; i < kPackets; ++i) {
    const std::int64_t now_ns = (*emulator)->next_due_ns();
    (*emulator)->pose(0, drivers::glove::hand_frame(any_pose(random)));
    packet.clear();
    arrived.clear();
    (*emulator)->emit(now_ns, packet);
    truth.clear();
    clean->feed(packet, now_ns, truth);
    REQUIRE(truth.samples.size() == 1);
    judge.sent(truth.samples[0], line.pass(packet, now_ns, arrived));
    got.clear();
    noisy->feed(arrived, now_ns, got);
    for (const Sample& sample : got.samples) judge.came(sample);
  }
  return judge.tally();
}

}  // namespace

TEST_CASE(
    "noise on the line loses only the packets it touched, and only sent packets are published") {
  for (const DeviceFixture& fixture : test::device_fixtures()) {
    if (!fixture.emulated || fixture.whole_reports || fixture.datagrams) continue;
    if (find_driver(fixture.driver)->glove == nullptr) continue;
    INFO(fixture.name);
    const Tally tally = stream_through_noise(fixture);
    const std::size_t damaged = tally.sent - tally.whole;
    const double blind = static_cast<double>(tally.wrong) / static_cast<double>(damaged);
    const double through =
        static_cast<double>(tally.whole_through) / static_cast<double>(tally.whole);
    std::printf(
        "noise: %-26s %5.1f %% of packets untouched, %.2f %% of them through, "
        "%zu wrong published (%.3f %% of damaged), %zu untouched lost in a row\n",
        fixture.name.c_str(),
        100.0 * static_cast<double>(tally.whole) / static_cast<double>(tally.sent), 100.0 * through,
        tally.wrong, 100.0 * blind, tally.lost_in_a_row);
    CHECK(through >= 0.9);
    CHECK(blind <= allowed_share(fixture));
    CHECK(tally.lost_in_a_row <= 2);
  }
}

}  // namespace posed::drivers
