// The published frames of a recording daemon, from its log.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"
#include "proto/log/reader.hpp"

namespace posed::test {

// Checks that the sequence numbers of a stream's published frames in the log have no gap. Calls
// `look` with each frame and returns the last number.
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
    while (true) {
      const auto frame = frames->next();
      REQUIRE(frame);
      if (!*frame) break;
      const std::uint64_t sequence = (*frame)->sequence;
      CHECK((sequence == last + 1 || sequence == last));  // a stale frame is published again
      last = sequence;
      v1::Frame message;
      const auto bytes = (*frame)->bytes;
      REQUIRE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
      look(message);
    }
  }
  return last;
}

}  // namespace posed::test
