// The pace of a replay: that of the recording, except for long silences.
#include <catch2/catch.hpp>

#include "daemon/tools/replay/pace.hpp"
#include "daemon/tools/replay/replay_stream_context.hpp"

using namespace posed;
using replay::Pace;

namespace {

log::ChunkRow chunk_at(double at_s,
                       pipeline::Direction direction = pipeline::Direction::kFromDevice) {
  return {.direction = static_cast<std::uint8_t>(direction), .arrival_ns = nanoseconds(at_s)};
}

}  // namespace

TEST_CASE("chunks are due at their recorded times divided by the speed") {
  Pace half(0.5);
  CHECK(half.step(chunk_at(100.0)).due_ns == 0);
  CHECK(half.step(chunk_at(101.5)).due_ns == nanoseconds(3.0));
  CHECK(half.step(chunk_at(101.5)).due_ns == nanoseconds(3.0));
  Pace twice(2.0);
  CHECK(twice.step(chunk_at(100.0)).due_ns == 0);
  // an unplugged glove: not skipped
  CHECK(twice.step(chunk_at(140.0)).due_ns == nanoseconds(20.0));
}

TEST_CASE("a single wrong time in a log is skipped and reported, and the pace continues after it") {
  Pace pace(1.0);
  CHECK(pace.step(chunk_at(100.0)).due_ns == 0);
  const auto far = pace.step(chunk_at(1e9));
  CHECK(far.due_ns == 0);
  CHECK(far.skipped_ns == nanoseconds(1e9) - nanoseconds(100.0));
  const auto back = pace.step(chunk_at(100.1));
  CHECK(back.due_ns == 0);
  CHECK(back.skipped_ns == 0);
  CHECK(pace.step(chunk_at(100.6)).due_ns == nanoseconds(0.5));
}

// An older version logged a calibration that is in use from the start with the time 0: the replay
// of such a log waited for as long as the machine had been running.
TEST_CASE("a calibration before the first chunk causes no wait") {
  Pace pace(1.0);
  CHECK(pace.step(chunk_at(0.0, pipeline::Direction::kCalibration)).due_ns == 0);
  const auto first = pace.step(chunk_at(40000.0));
  CHECK(first.due_ns == 0);
  CHECK(first.skipped_ns == 0);
  CHECK(pace.step(chunk_at(40000.0, pipeline::Direction::kCalibration)).due_ns == 0);
  CHECK(pace.step(chunk_at(40001.0)).due_ns == nanoseconds(1.0));
}

TEST_CASE("shed frames are found by number, in whatever order they were added") {
  replay::ShedRanges ranges;
  ranges.add(10, 3);
  ranges.add(1, 2);
  ranges.add(11, 5);
  ranges.add(30, 0);
  ranges.finish();
  for (const std::uint64_t shed : {1, 2, 10, 12, 15}) CHECK(ranges.contains(shed));
  for (const std::uint64_t kept : {0, 3, 9, 16, 30, 31}) CHECK_FALSE(ranges.contains(kept));
}
