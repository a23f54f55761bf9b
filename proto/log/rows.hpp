// The rows of a device log, one struct a table. Ids of chunks, decisions and frames are their order
// in the log. All times are the recording host's CLOCK_MONOTONIC [ns].
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace posed::log {

// Table stream: a stream as it stood when recording began; enough to decode its chunks again.
struct StreamRow {
  std::uint32_t id = 0;
  std::string name;      // as on the wire
  std::string driver;    // registry name
  std::string text;      // the device's own header, the decoder's input
  std::string identity;  // path or serial number
  std::string config;    // its [[stream]] table with every default filled in
  std::string model;     // SHA-256 of the model it began with; empty when it had none
};

// Table chunk: what one read gave, before decoding.
struct ChunkRow {
  std::int64_t id = 0;  // given by the writer
  std::uint32_t stream = 0;
  std::uint8_t direction = 0;  // 0 from the device, 1 to it
  std::int64_t arrival_ns = 0;
  std::uint64_t next_sequence = 0;   // what the first frame decoded from it was numbered
  std::span<const std::byte> bytes;  // from a reader: valid until its next call
};

// Table decision: what the pipeline decided and decoding cannot repeat; takes effect just before
// frame `sequence` of its stream. Kinds are those of posed::pipeline::Decision.
struct DecisionRow {
  std::uint32_t stream = 0;
  std::uint8_t kind = 0;
  std::uint64_t sequence = 0;
  std::uint64_t count = 0;
  std::int64_t now_ns = 0;
  double alpha = 0.0;
  std::string model_hash;
  // Of a play: "0 4 1", indices into the model; count 1 is a loop, alpha the tempo.
  std::string labels{};
};

// Table frame, only when published frames were asked for: a posed.v1.Frame without stage stamps.
struct FrameRow {
  std::uint32_t stream = 0;
  std::uint64_t sequence = 0;
  bool raw = false;  // the unstyled input
  std::span<const std::byte> bytes;
};

// Table gap: something the log lacks, so that nobody takes it for whole.
struct GapRow {
  enum class Kind : std::uint8_t { kChunks = 0, kDecisions = 1, kFrames = 2 };
  std::uint32_t stream = 0;
  Kind kind = Kind::kChunks;
  std::int64_t after_chunk = 0;  // id of the stream's last chunk before it; 0 when there is none
  std::uint64_t lost = 0;
  std::int64_t time_ns = 0;  // when it was noticed
};

}  // namespace posed::log
