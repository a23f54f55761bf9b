// Replays a device log in this process and compares the result with the frames that were published
// live.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/tools/replay/expectation.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "proto/log/reader.hpp"
#include "proto/message/frame_message.hpp"

namespace posed::test {

struct Replayed {
  std::vector<std::string> frames;  // serialized, in the order of the pipeline
  std::optional<Error> difference;  // the first one, or why the log cannot be replayed
  replay::Expectation::Counts counts;
};

// `expect`: compare with the published frames that the log holds. `keep`: the frames, too.
inline Replayed replayed(const std::filesystem::path& path, bool expect = true, bool keep = true) {
  Replayed result;
  auto reader = log::Reader::open(path);
  REQUIRE(reader);
  auto opened = replay::Replay::open(*reader);
  if (!opened) {
    result.difference = opened.error();
    return result;
  }
  replay::Replay& replay = **opened;
  std::optional<replay::Expectation> expectation;
  if (expect) {
    auto live = replay::Expectation::open(*reader);
    if (!live) {
      result.difference = live.error();
      return result;
    }
    expectation = std::move(*live);
  }
  std::vector<message::FrameEncoder> encoders;  // for the styled and the raw topic of each stream
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    encoders.emplace_back(replay.stream(id).name);
    encoders.emplace_back(replay.stream(id).name + "-raw");
  }
  const auto note = [&](const Result<>& same) {
    if (!same && !result.difference) result.difference = same.error();
  };
  const auto done = replay.run(
      [&](const pipeline::Item& item) {
        const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
        if (!raw && item.kind != pipeline::Item::Kind::kFrame) return;
        const std::uint32_t stream = item.frame.header.stream;
        const v1::Frame& frame = encoders[2 * stream + (raw ? 1 : 0)].encode(item.frame);
        if (keep) result.frames.push_back(frame.SerializeAsString());
        if (expect) note(expectation->compare(stream, raw, frame, replay.broken_at(stream)));
      },
      [](const log::ChunkRow&) { return true; });
  note(done);
  for (std::uint32_t id = 0; expect && !result.difference && id < replay.streams(); ++id) {
    note(expectation->finish(id, replay.broken_at(id)));
  }
  if (expect) result.counts = expectation->counts();
  return result;
}

}  // namespace posed::test
