// Bodies that come, go, come back and change their skeleton while the daemon records: every frame
// of every stream replays bit for bit, the numbers of a name go on, and streams beside them lose
// nothing. Each seed is another run on the virtual clock (tests/support/seeds.hpp).
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "tests/support/dice.hpp"
#include "tests/support/gapped_logs.hpp"
#include "tests/support/numbers_of_names.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

constexpr double kRoomLength_s = 4.0;

// What the runs of a test met, so that the test can tell that it tests something.
struct Met {
  std::uint64_t frames = 0;
  std::size_t streams = 0, refused = 0, changes = 0, returns = 0, warnings = 0;

  Met& operator+=(const Met& other) {
    frames += other.frames;
    streams += other.streams;
    refused += other.refused;
    changes += other.changes;
    returns += other.returns;
    warnings += other.warnings;
    return *this;
  }
};

Met met_by(const VirtualDaemon& daemon) {
  Met met{.warnings = daemon.warnings()};
  std::map<std::string, std::set<std::uint32_t>> slots;
  for (const VirtualBody& body : daemon.bodies()) {
    met.frames += body.published.frames + body.published.raw;
    ++met.streams;
    met.refused += body.refusal.empty() ? 0 : 1;
    const bool is_new = slots[body.name].insert(pipeline::slot_of(body.stream)).second;
    met.changes += is_new ? 0 : 1;
    met.returns += is_new && slots[body.name].size() > 1 ? 1 : 0;
  }
  return met;
}

VirtualSource random_room(const std::string& name, Dice& dice, std::size_t slots) {
  VirtualSource room = mocap_source(name, kRoomLength_s, dice.seed());
  room.slots = slots;
  if (dice.chance(0.5)) disturb(room, dice.seed());
  return room;
}

// Runs the daemon as the seed determines; the log is at `path`.
Met record_rooms(std::uint64_t seed, const std::filesystem::path& path, VirtualOptions options) {
  Dice dice(seed);
  options.seed = dice.seed();
  options.log = path;
  options.bodies = static_cast<std::size_t>(dice.chance(0.2) ? 3 : 12);
  VirtualDaemon daemon(options);
  const std::size_t slots = dice.chance(0.2) ? 16 : 96;
  VirtualStream walker = walking_stream("walker", kRoomLength_s);
  walker.slots = slots;
  disturb(walker, dice.seed());
  daemon.add(std::move(walker));
  for (int i = 0; i < (dice.chance(0.2) ? 2 : 1); ++i) {
    VirtualSource room = random_room(i == 0 ? "room" : "hall", dice, slots);
    for (int n = dice.below(12); n > 0; --n) {
      const auto body = static_cast<std::size_t>(dice.below(static_cast<int>(room.bodies.size())));
      daemon.command({.at_s = dice.within(0.0, kRoomLength_s),
                      .alpha = static_cast<float>(dice.within(-2.0, 2.0)),
                      .body = room.bodies[body]});
    }
    daemon.add(std::move(room));
  }
  daemon.run(kRoomLength_s + dice.within(-1.0, 1.5));
  static_cast<void>(check_numbers(daemon.bodies()));
  Met met = met_by(daemon);
  met.frames += daemon.published(0).frames + daemon.published(0).raw;
  return met;
}

}  // namespace

TEST_CASE("whatever bodies do while it is recorded, a log replays bit for bit",
          "[property][virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "rooms.plog";
  const auto [first, last] = seeds(1);
  VirtualOptions roomy;
  roomy.record_slot.frame_bytes = 1 << 20;
  Met sum;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    const Met met = record_rooms(seed, path, roomy);
    const Replayed result = replayed(path);
    REQUIRE((result.difference ? result.difference->text() : "") == "");
    CHECK(result.counts.after_gap + result.counts.past_end == 0);
    CHECK(result.counts.compared == met.frames);
    sum += met;
    std::filesystem::remove(path);
  }
  WARN(last - first + 1 << " runs replayed, " << sum.frames << " frames of " << sum.streams
                        << " streams compared: " << sum.refused << " refused, " << sum.changes
                        << " with another skeleton, " << sum.returns
                        << " in another slot than before; " << sum.warnings << " warnings");
  if (!few_seeds()) {
    CHECK((sum.refused > 0 && sum.changes > 0 && sum.returns > 0 && sum.warnings > 0));
  }
}

// A log may lack chunks, decisions, frames and the rows that say which bodies there are.
TEST_CASE("a log of bodies with gaps replays what it contains and reports what is missing",
          "[property][virtual]") {
  check_gapped_logs(2, [](Dice& dice, std::uint64_t seed, const std::filesystem::path& path) {
    VirtualOptions scarce;
    scarce.chunk_bytes = static_cast<std::size_t>(1000 * dice.below(60) + 2000);
    scarce.record_slot = {.frame_bytes = static_cast<std::size_t>(1000 * dice.below(60) + 2000),
                          .decisions = static_cast<std::size_t>(dice.below(12) + 1)};
    static_cast<void>(record_rooms(seed, path, scarce));
  });
}

// Without holdups and with space in the rings, no stream has a reason to lose anything. Only a
// device that sends many frames at once, as a disturbed one does, may have some shed.
TEST_CASE("bodies that come and go cost no frame, neither their own nor of others",
          "[property][virtual]") {
  const auto [first, last] = seeds(4);
  std::uint64_t frames = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    Dice dice(seed);
    VirtualDaemon daemon({.seed = dice.seed(), .log = {}, .holdups = false, .bodies = 12});
    daemon.add(walking_stream("walker", kRoomLength_s));
    daemon.add(glove_stream("hand", kRoomLength_s));
    const bool calm = dice.chance(0.5);
    VirtualSource room = mocap_source("room", kRoomLength_s, dice.seed());
    room.slots = 256;
    if (!calm) disturb(room, dice.seed());
    daemon.add(std::move(room));
    daemon.run(kRoomLength_s + 1.0);
    CHECK(daemon.published(0).raw == 240);
    CHECK(daemon.published(1).samples == 400);
    for (const std::uint32_t stream : {0U, 1U}) {
      const pipeline::StreamCounters& counters = daemon.counters(stream);
      CHECK(counters.reader.dropped + counters.pipeline.shed + counters.pipeline.dropped == 0);
      const auto& sequences = daemon.published(stream).sequences;
      CHECK(std::set(sequences.begin(), sequences.end()).size() == (stream == 0 ? 240 : 400));
      CHECK(std::ranges::is_sorted(sequences));
    }
    static_cast<void>(check_numbers(daemon.bodies()));
    for (const VirtualBody& body : daemon.bodies()) {
      if (calm) CHECK(body.lost == 0);
      frames += body.published.frames;
    }
  }
  WARN(last - first + 1 << " runs, " << frames << " frames of bodies");
}

// What went wrong while the parts could not keep up is over when they can: a stream that took the
// slot of another with items on their way has its whole share of the rings.
TEST_CASE("when nothing is held up any more, every body is streamed to its last frame",
          "[property][virtual]") {
  const auto [first, last] = seeds(1);
  std::size_t present = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
    Dice dice(seed);
    VirtualOptions options{.seed = dice.seed(), .log = {}};
    options.turns_between_holdups = 100;
    options.calm_from_s = kRoomLength_s - 2.0;
    VirtualDaemon daemon(options);
    VirtualSource room = mocap_source("room", kRoomLength_s, dice.seed());
    room.slots = 24;
    daemon.add(std::move(room));
    daemon.run(kRoomLength_s + 0.5);
    for (const auto& [text, name] : check_numbers(daemon.bodies())) {
      if (name.left || !name.last_decoded) continue;
      INFO(text);
      CHECK((name.published.empty() ? 0 : *name.published.rbegin()) == name.decoded);
      ++present;
    }
  }
  if (!few_seeds()) CHECK(present > 0);
}

}  // namespace posed::test
