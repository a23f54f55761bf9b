// What the daemon guarantees in whatever order its parts get their turns. On a virtual clock, so
// that a device can flood it for any length of time.
#include <catch2/catch.hpp>

#include <set>

#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {
namespace {

// A glove that sends valid lines without a pause from 1 s to 1.5 s.
VirtualStream flooding_glove() {
  VirtualStream glove = glove_stream("flood", 4.0);
  const std::string line = glove.links[0].chunks[50].bytes;
  std::string flood;
  while (flood.size() < 4000) flood += line;
  glove.links[0].until_s = 1.0;
  glove.links.push_back({.from_s = 1.0, .chunks = {}, .until_s = 1.5, .flood = flood});
  glove.links.push_back({.from_s = 1.5, .chunks = {}, .until_s = kNever_s, .flood = {}});
  return glove;
}

std::uint64_t lost(const pipeline::StreamCounters& counters) {
  return counters.reader.dropped + counters.pipeline.shed + counters.pipeline.dropped;
}

}  // namespace

TEST_CASE("on the virtual clock every frame and sample arrives, in order", "[virtual]") {
  VirtualDaemon daemon({.seed = 1, .log = {}, .holdups = false});
  daemon.add(walking_stream("walker", 3.0));
  daemon.add(glove_stream("hand", 3.0));
  daemon.run(4.0);
  CHECK(daemon.published(0).raw == 180);
  CHECK(daemon.published(1).samples == 300);
  for (const std::uint32_t stream : {0U, 1U}) {
    INFO("stream " << stream);
    CHECK(lost(daemon.counters(stream)) == 0);
    const auto& sequences = daemon.published(stream).sequences;
    const std::set<std::uint64_t> once(sequences.begin(), sequences.end());
    CHECK(once.size() == (stream == 0 ? 180 : 300));
    CHECK(std::ranges::is_sorted(sequences));
  }
}

TEST_CASE("a device that sends without a pause does not affect another stream", "[virtual]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    INFO("seed " << seed);
    VirtualDaemon daemon({.seed = seed, .log = {}, .holdups = false, .turn_us = 1000.0});
    daemon.add(walking_stream("walker", 4.0));
    daemon.add(flooding_glove());
    daemon.run(4.5);
    CHECK(daemon.published(0).raw == 240);
    CHECK(lost(daemon.counters(0)) == 0);
    CHECK(lost(daemon.counters(1)) > 1000);
  }
}

TEST_CASE("every command is acknowledged, however full the rings are", "[virtual]") {
  VirtualDaemon daemon({.seed = 5, .log = {}, .ack_slots = 4});
  daemon.add(walking_stream("walker", 4.0));
  daemon.add(flooding_glove());
  constexpr std::size_t kCommands = 2000;
  for (std::size_t i = 0; i < kCommands; ++i) {
    const double at_s = 1.0 + 0.00025 * static_cast<double>(i);
    if (i % 2 == 0) {
      daemon.command({.at_s = at_s, .stream = 0, .alpha = 0.5F});
    } else {
      daemon.command({.at_s = at_s,
                      .stream = 1,
                      .kind = VirtualCommand::Kind::kCalibrate,
                      .bytes = glove_calibration(static_cast<int>(i % 7))});
    }
  }
  daemon.run(8.0);
  REQUIRE(daemon.acks().size() == kCommands);
  std::set<std::uint64_t> tickets;
  for (const pipeline::Ack& ack : daemon.acks()) tickets.insert(ack.ticket);
  CHECK(tickets.size() == kCommands);
}

}  // namespace posed::test
