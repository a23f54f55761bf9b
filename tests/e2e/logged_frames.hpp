// The published frames of a recording daemon, from its log.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "posed/v1/log.pb.h"
#include "posed/v1/posed.pb.h"
#include "proto/log/reader.hpp"

namespace posed::test {

// Frames of a stream that are not in the log by the log's own account: those that a busy machine
// shed, and those that its recorder had no room for.
inline std::uint64_t frames_accounted_for(const log::Reader& reader, std::uint32_t stream) {
  std::uint64_t count = 0;
  const auto decisions = reader.decisions();
  REQUIRE(decisions);
  for (const log::DecisionRow& row : *decisions) {
    if (row.stream != stream || row.name != log::words::kShed) continue;
    v1::DecisionValue value;
    REQUIRE(value.ParseFromString(row.value));
    count += value.range().count();
  }
  const auto gaps = reader.gaps();
  REQUIRE(gaps);
  for (const log::GapRow& row : *gaps) {
    if (row.owner == stream && row.kind == log::GapRow::Kind::kFrames) count += row.lost;
  }
  return count;
}

// Checks that a stream's published frames in the log are in order and without a gap that the log
// does not account for. Calls `look` with each frame and returns the last number.
inline std::uint64_t check_frames_follow(
    const std::string& log, const std::string& stream,
    const std::function<void(const v1::Frame&)>& look = [](const v1::Frame&) {}) {
  auto reader = log::Reader::open(log);
  REQUIRE(reader);
  std::uint64_t last = 0;
  for (const log::StreamRow& row : reader->streams()) {
    if (row.name != stream) continue;
    auto frames = reader->frames(row.id, false);
    REQUIRE(frames);
    std::uint64_t skipped = 0;
    while (true) {
      const auto frame = frames->next();
      REQUIRE(frame);
      if (!*frame) break;
      const std::uint64_t sequence = (*frame)->sequence;
      CHECK(sequence >= last);  // a stale frame is published again
      if (sequence > last + 1) skipped += sequence - last - 1;
      last = sequence;
      v1::Frame message;
      const auto bytes = (*frame)->bytes;
      REQUIRE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
      look(message);
    }
    CHECK(skipped <= frames_accounted_for(*reader, row.id));
  }
  return last;
}

// Waits until the recording has something that a kill cannot take away: what another process reads
// is committed.
inline void await_commit(const std::string& log) {
  const auto committed = [&] {
    auto reader = log::Reader::open(log);
    if (!reader) return false;
    const auto chunk = reader->next_chunk();
    return chunk && *chunk;
  };
  for (int i = 0; i < 1500 && !committed(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  REQUIRE(committed());
}

}  // namespace posed::test
