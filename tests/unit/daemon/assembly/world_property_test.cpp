// A world without mercy, one for each seed: gloves, files and mocap systems that stall, are
// unplugged and send garbage, bodies that come and go, commands, parts of the daemon that are held
// up, a full disk, a computer that sleeps, a kill. Whatever happens, frames come in order, with
// sound poses and of the right body, each one that is missing is counted, the log has what it must
// have and replays bit for bit, and streams recover.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "proto/log/reader.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/numbers_of_names.hpp"
#include "tests/support/random_streams.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

constexpr double kTrouble_s = 4.0;  // what happens, happens before
constexpr double kCalm_s = 1.5;     // and then nothing does
// The recorder commits every 0.25 s and looks every 0.05 s; what is older than this is on the disk.
constexpr double kCommitted_s = 0.5;

VirtualOptions random_trouble(Dice& dice, const std::filesystem::path& log) {
  VirtualOptions options{.seed = dice.seed(), .log = log, .calm_from_s = kTrouble_s};
  if (dice.chance(0.4)) {
    const double from_s = dice.within(0.0, kTrouble_s - 0.1);
    options.disk_full.push_back({from_s, dice.within(from_s, kTrouble_s)});
  }
  if (dice.chance(0.3)) {
    const double from_s = dice.within(0.0, kTrouble_s);
    options.asleep.push_back({from_s, from_s + dice.within(0.0, dice.chance(0.5) ? 2.0 : 7200.0)});
  }
  if (dice.chance(0.3)) {  // with a recorder that kept up before
    options.killed_at_s = dice.within(kCommitted_s, kTrouble_s);
    options.calm_from_s = options.killed_at_s - 2 * kCommitted_s;
    options.disk_full.clear();
    options.asleep.clear();
  }
  options.bodies = 12;
  // In half of the worlds a source whose bodies come and go has soon made its share of streams.
  if (options.seed % 2 == 0) options.max_made = 40;
  // Less than all that the run records, so that the shares have to be given back, and enough for
  // the longest time that the recorder is held up. After a sleep all that the devices' buffers kept
  // comes at once, which needs more.
  if (options.asleep.empty()) {
    options.chunk_bytes = 96 << 10;
    options.record_slot = {.frame_bytes = 192 << 10, .decisions = 192};
  }
  return options;
}

double end_of(const VirtualOptions& options) {
  double end_s = kTrouble_s + kCalm_s;
  for (const Spell& spell : options.asleep) end_s += spell.until_s - spell.from_s;
  return end_s;
}

constexpr int kLastFrames = 30;

// Bytes that mean nothing, between those of the glove, but not between its last frames.
void litter(ScriptedLink& link, Dice& dice) {
  const int places = static_cast<int>(link.chunks.size()) - kLastFrames - 1;
  for (int i = places > 0 ? dice.below(20) : 0; i > 0; --i) {
    const auto at = link.chunks.begin() + dice.below(places);
    std::string bytes(static_cast<std::size_t>(dice.below(300)), ' ');
    for (char& byte : bytes) byte = static_cast<char>(dice.below(256));
    link.chunks.insert(at, {.at_s = at->at_s, .bytes = bytes});
  }
}

// The link's last frames come one after the other while nothing else happens, unless it is still
// late then.
bool end_calmly(ScriptedLink& link, double end_s) {
  if (link.chunks.size() <= kLastFrames) return false;
  const auto first = link.chunks.end() - kLastFrames;
  double at_s = end_s - 0.8;
  if ((first - 1)->at_s > at_s - 0.2) return false;
  for (auto chunk = first; chunk != link.chunks.end(); ++chunk, at_s += 0.017) chunk->at_s = at_s;
  return true;
}

struct World {
  explicit World(Dice& dice, const std::filesystem::path& log);

  VirtualOptions options;
  std::unique_ptr<VirtualDaemon> daemon;
  std::vector<std::string> names;  // of the streams with a device of their own
  std::vector<bool> recovers;      // their devices are well at the end
};

World::World(Dice& dice, const std::filesystem::path& log) : options(random_trouble(dice, log)) {
  daemon = std::make_unique<VirtualDaemon>(options);
  const std::size_t slots = dice.chance(0.2) ? 16 : 256;
  for (const What what : {What::kBody, What::kHand}) {
    const auto id = static_cast<std::uint32_t>(names.size());
    names.push_back(what == What::kBody ? "walker" : "hand");
    VirtualStream stream = what == What::kBody ? random_body(names.back(), kTrouble_s, dice)
                                               : random_hand(names.back(), kTrouble_s, dice);
    stream.slots = slots;
    if (dice.chance(0.7)) disturb(stream, dice.seed());
    if (what == What::kHand) litter(stream.links.back(), dice);
    recovers.push_back(end_calmly(stream.links.back(), end_of(options)));
    daemon->add(std::move(stream));
    for (int i = dice.below(8); i > 0; --i) {
      daemon->command(random_command(id, what, kTrouble_s, dice));
    }
  }
  if (dice.chance(0.6)) {
    VirtualSource room = mocap_source("room", kTrouble_s, dice.seed());
    room.slots = slots;
    if (dice.chance(0.7)) disturb(room, dice.seed());
    daemon->add(std::move(room));
  }
  // Not where the computer sleeps: all that she did meanwhile would come at once.
  if (options.asleep.empty()) {
    VirtualSource guest = guest_source("guest", kTrouble_s - 1.0, end_of(options));
    guest.slots = slots;
    daemon->add(std::move(guest));
  }
}

// All streams that there were.
std::vector<VirtualBody> streams_of(const World& world) {
  std::vector<VirtualBody> streams = world.daemon->bodies();
  for (std::uint32_t id = 0; id < world.names.size(); ++id) {
    const pipeline::StreamCounters& counters = world.daemon->counters(id);
    streams.push_back({.stream = id,
                       .source = world.names[id],
                       .body = {},
                       .name = world.names[id],
                       .published = world.daemon->published(id),
                       .decoded = counters.reader.frames,
                       .unpublished = counters.pipeline.dropped});
  }
  return streams;
}

// The sequences of a stream's frames in the log.
std::set<std::uint64_t> frames_in(const log::Reader& reader, std::uint32_t stream, bool raw,
                                  std::uint64_t& rows) {
  std::set<std::uint64_t> sequences;
  auto frames = reader.frames(stream, raw);
  REQUIRE(frames);
  while (true) {
    const auto frame = frames->next();
    REQUIRE(frame);
    if (!*frame) return sequences;
    sequences.insert((*frame)->sequence);
    ++rows;
  }
}

// What was published is in the log, or counted in one of its gaps; after a kill, only what was
// published in the last half second may be missing. Returns how many frames are in gaps.
std::uint64_t check_log(const World& world, const std::vector<VirtualBody>& streams) {
  const bool killed = world.options.killed_at_s != kNever_s;
  auto reader = log::Reader::open(world.options.log);
  REQUIRE(reader);
  const auto gaps = reader->gaps();
  REQUIRE(gaps);
  std::map<std::uint32_t, std::uint64_t> lacking;
  for (const log::GapRow& gap : *gaps) {
    if (gap.kind == log::GapRow::Kind::kFrames) lacking[gap.owner] += gap.lost;
  }
  std::uint64_t sum = 0;
  for (const VirtualBody& stream : streams) {
    if (!stream.refusal.empty()) continue;
    INFO(stream.name << ", stream " << stream.stream);
    const VirtualDaemon::Published& published = stream.published;
    std::uint64_t rows = 0;
    const auto styled = frames_in(*reader, stream.stream, false, rows);
    static_cast<void>(frames_in(*reader, stream.stream, true, rows));
    const std::uint64_t all = published.frames + published.raw;
    // A frame for which the publisher had no room is in a gap, too: a replay computes it.
    CHECK(rows + lacking[stream.stream] <= all + stream.unpublished);
    if (!killed) CHECK(rows + lacking[stream.stream] >= all);
    sum += lacking[stream.stream];
    for (std::size_t i = 0; killed && i < published.sequences.size(); ++i) {
      if (published.at_s[i] > world.options.killed_at_s - kCommitted_s) break;
      if (!styled.contains(published.sequences[i])) {
        FAIL("frame " << published.sequences[i] << ", published at " << published.at_s[i]
                      << " s, is not in the log of a daemon killed at " << world.options.killed_at_s
                      << " s");
      }
    }
  }
  return sum;
}

// No stream has a pose of another's body: each person stands at a place of their own.
void check_places(const std::vector<VirtualBody>& bodies) {
  std::map<long, std::string> owners;
  for (const VirtualBody& body : bodies) {
    for (const long z_m : body.published.root_z_m) {
      const auto [owner, is_new] = owners.try_emplace(z_m, body.body);
      INFO(body.name << ", stream " << body.stream << ", at " << z_m << " m");
      CHECK(owner->second == body.body);
    }
  }
}

// Whoever the config names is streamed again when she returns, whatever the bodies of another
// source do.
void check_guest(const World& world) {
  const double end_s = end_of(world.options);
  std::size_t late = 0;
  for (const VirtualBody& body : world.daemon->bodies()) {
    if (body.name != "guest") continue;
    late += static_cast<std::size_t>(std::ranges::count_if(
        body.published.at_s, [&](double at_s) { return at_s > end_s - kCalm_s / 2; }));
  }
  CHECK(late > 0);
}

struct Lived {
  std::uint64_t frames = 0, compared = 0, in_gaps = 0, shed = 0;
  int kills = 0, full_disks = 0, sleeps = 0;
};

void check_world(std::uint64_t seed, const std::filesystem::path& log, Lived& met) {
  INFO("seed " << seed << "; POSED_SEED=" << seed << " runs it alone");
  Dice dice(seed);
  World world(dice, log);
  world.daemon->run(end_of(world.options));
  const bool killed = world.options.killed_at_s != kNever_s;
  const std::vector<VirtualBody> streams = streams_of(world);
  const auto names = check_numbers(streams, killed, {"hand"});
  for (std::uint32_t id = 0; id < world.names.size() && !killed; ++id) {
    INFO(world.names[id]);
    const NumbersOfName& name = names.at(world.names[id]);
    const std::uint64_t newest = world.daemon->counters(id).reader.newest;
    const std::uint64_t last = name.published.empty() ? 0 : *name.published.rbegin();
    if (name.unpublished == 0) CHECK(last >= newest);  // performed frames have numbers, too
    for (int i = 0; world.recovers[id] && i < kLastFrames; ++i) {
      CHECK(name.published.contains(std::max(last, name.decoded) - static_cast<std::uint64_t>(i)));
    }
  }
  check_places(world.daemon->bodies());
  if (!killed && world.options.asleep.empty()) check_guest(world);
  const Replayed result = replayed(log);
  REQUIRE((result.difference ? result.difference->text() : "") == "");
  if (!killed && world.daemon->write_errors() == 0) {
    CHECK(result.counts.after_gap + result.counts.past_end == 0);
  }
  met.in_gaps += check_log(world, streams);
  met.compared += result.counts.compared;
  for (const auto& [text, name] : names) {
    met.frames += name.published.size();
    met.shed += name.missed;
  }
  met.kills += killed ? 1 : 0;
  met.full_disks += world.daemon->write_errors() > 0 ? 1 : 0;
  met.sleeps += world.options.asleep.empty() ? 0 : 1;
}

}  // namespace

TEST_CASE("whatever happens in the world, the daemon keeps its promises", "[property][virtual]") {
  const TempFolder folder;
  const auto [first, last] = seeds(1);
  Lived met;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const auto path = folder.path() / (std::to_string(seed) + ".plog");
    check_world(seed, path, met);
    std::filesystem::remove(path);
  }
  WARN(last - first + 1 << " worlds: " << met.frames << " frames published, " << met.shed
                        << " shed, " << met.compared << " compared with their replay, "
                        << met.in_gaps << " in gaps of logs; " << met.kills << " kills, "
                        << met.full_disks << " full disks, " << met.sleeps << " sleeps");
  if (!few_seeds()) {
    CHECK((met.kills > 0 && met.full_disks > 0 && met.sleeps > 0 && met.in_gaps > 0));
    CHECK(met.shed > 0);
  }
}

}  // namespace posed::test
