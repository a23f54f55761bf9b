// Whatever happens while a daemon records, the replay of its log gives what it published, bit for
// bit. Each seed is another run on the virtual clock, with other stalls, unplugs, bursts and
// commands, and another order of the parts' turns. tests/support/seeds.hpp says which seeds run.
#include <catch2/catch.hpp>

#include <cstdint>
#include <string>

#include "daemon/devices/stream_stages.hpp"
#include "models/gate/gate_stage.hpp"
#include "models/generate/generate_stage.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/gapped_logs.hpp"
#include "tests/support/random_streams.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/seeds.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

constexpr double kLength_s = 2.5;

// Runs the daemon as the seed determines; the log is at `path`.
void record_run(std::uint64_t seed, const std::filesystem::path& path,
                VirtualOptions options = {}) {
  Dice dice(seed);
  options.seed = dice.seed();
  options.log = path;
  VirtualDaemon daemon(options);
  const bool small_rings = dice.below(8) == 0;
  std::vector<What> streams{What::kBody, What::kHand};
  if (dice.below(3) == 0) streams.push_back(dice.below(2) == 0 ? What::kBody : What::kHand);
  for (std::uint32_t id = 0; id < streams.size(); ++id) {
    const std::string name = "s" + std::to_string(id);
    VirtualStream stream = streams[id] == What::kBody ? random_body(name, kLength_s, dice)
                                                      : random_hand(name, kLength_s, dice);
    stream.slots = small_rings ? 16 : 256;
    disturb(stream, dice.seed());
    daemon.add(std::move(stream));
    for (int i = dice.below(10); i > 0; --i) {
      daemon.command(random_command(id, streams[id], kLength_s, dice));
    }
  }
  daemon.run(kLength_s + dice.within(0.0, 2.5));
}

// Returns the number of frames that were compared.
std::uint64_t check_seed(std::uint64_t seed, const std::filesystem::path& path) {
  record_run(seed, path);
  const Replayed result = replayed(path);
  if (result.difference) {
    FAIL("seed " << seed << ": " << result.difference->text() << "; POSED_SEED=" << seed
                 << " runs it alone");
  }
  INFO("seed " << seed);
  CHECK(result.counts.after_gap + result.counts.past_end == 0);
  CHECK(result.counts.compared > 0);
  std::filesystem::remove(path);
  return result.counts.compared;
}

}  // namespace

TEST_CASE("whatever happens while it is recorded, a log replays bit for bit",
          "[property][virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "run.plog";
  const auto [first, last] = seeds(4);  // each takes about a second
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) compared += check_seed(seed, path);
  WARN(last - first + 1 << " runs replayed, " << compared << " frames compared");
}

// A recorder that is held up loses chunks, decisions and frames.
TEST_CASE("a log with gaps replays what it contains and reports what is missing",
          "[property][virtual]") {
  check_gapped_logs(4, [](Dice& dice, std::uint64_t seed, const std::filesystem::path& path) {
    VirtualOptions scarce;
    scarce.chunk_bytes = static_cast<std::size_t>(1000 * dice.below(40) + 2000);
    scarce.record_slot = {.frame_bytes = static_cast<std::size_t>(4000 * dice.below(40) + 4000),
                          .decisions = static_cast<std::size_t>(dice.below(12) + 1)};
    record_run(seed, path, scarce);
  });
}

// The decoder gives a sample before its frame. A replay that passes on the sample before the tick
// that ended the silence would differ from the live run.
TEST_CASE("a glove that was silent, with frames waiting in the generate stage, replays",
          "[virtual]") {
  for (const int lag : {0, 1, 2, 3}) {
    INFO("lag " << lag);
    const TempFolder folder;
    const auto path = folder.path() / "silent.plog";
    VirtualDaemon daemon({.seed = 1, .log = path, .holdups = false});
    VirtualStream hand = glove_stream("hand", 2.0);
    set_lag(hand.settings.stages[0], lag);
    for (ScriptedChunk& chunk : hand.links[0].chunks) {
      if (chunk.at_s >= 1.0) chunk.at_s += 0.3;
    }
    daemon.add(std::move(hand));
    daemon.run(3.0);
    const Replayed result = replayed(path);
    INFO((result.difference ? result.difference->text() : ""));
    CHECK_FALSE(result.difference);
    CHECK(result.counts.compared >= 200);
    CHECK(result.counts.lost + result.counts.after_gap + result.counts.past_end == 0);
  }
}

// Every angle jumps and comes back, by whole movements of the hand. Two of the five are no quicker
// than fingers can be, and have company (models/gate/README.md).
TEST_CASE("a smoothed hand has the gate by default, and its log replays the drops", "[virtual]") {
  const TempFolder folder;
  const auto path = folder.path() / "spikes.plog";
  VirtualStream hand = glove_stream("hand", 2.0);
  config::StreamConfig config;
  config.name = "hand";
  config.stages.push_back(
      {.type = &generate::generate_type(),
       .parameters = complete_parameters(generate::generate_type().parameters, {}).value()});
  devices::ModelFiles files;
  const auto stages = [&] {
    const auto loaded = devices::load_stages(config, hand.description.skeleton, 100.0, files, {});
    REQUIRE(loaded);
    return loaded->settings.stages;
  };
  const std::vector<std::string> model_files = hand.model_files;
  for (const bool gated : {true, false}) {
    INFO("gate " << gated);
    hand.settings.stages = stages();
    CHECK((hand.settings.stages.front().type == &gate::gate_type()) == gated);
    hand.model_files = model_files;
    if (gated) hand.model_files.insert(hand.model_files.begin(), "");
    REQUIRE(hand.model_files.size() == hand.settings.stages.size());
    VirtualStream spiky = hand;
    for (const std::size_t spike : {30U, 50U, 70U, 110U, 150U}) {
      spiky.links[0].chunks[spike].bytes = hand.links[0].chunks[(spike + 50) % 100].bytes;
    }
    VirtualDaemon daemon({.seed = 1, .log = path, .holdups = false});
    daemon.add(std::move(spiky));
    daemon.run(2.5);
    const Replayed result = replayed(path);
    INFO((result.difference ? result.difference->text() : ""));
    CHECK_FALSE(result.difference);
    CHECK(result.counts.compared >= 190);
    long bridged = 0;
    for (const std::string& bytes : result.frames) {
      v1::Frame frame;
      REQUIRE(frame.ParseFromString(bytes));
      if (frame.quality() == v1::QUALITY_PREDICTED) ++bridged;
    }
    CHECK(bridged == (gated ? 3 : 0));
    config.off.push_back(&gate::gate_type());  // enabled = false
    std::filesystem::remove(path);
  }
}

}  // namespace posed::test
