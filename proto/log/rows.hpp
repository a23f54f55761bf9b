// The rows of a device log, one struct a table, as format 3 has them. Ids are the order of things
// within a table. All times are the recording host's CLOCK_MONOTONIC [ns]. Ids of sources and
// streams are names, not places: they need not be dense.
//
// An item is a frame, a sample or a notice on its way from the reader to the pipeline; items are
// counted from 1 over all streams, dropped ones included. Formats 1 and 2 did not count them: the
// numbers of items, and of samples, are then 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace posed::log {

// Table source: an opened device as it stood when recording began; enough to decode its chunks
// again.
struct SourceRow {
  std::uint32_t id = 0;
  std::string name;
  std::string driver;    // registry name
  std::string text;      // the device's own header, the decoder's input
  std::string identity;  // path or serial number
  std::string config;    // the driver's options as JSON, every default filled in
};

// Table stream: one body of a source, from an item on.
struct StreamRow {
  std::uint32_t id = 0;
  std::uint32_t source = 0;
  std::string body;         // its name in the source; empty where the source has one body only
  std::string name;         // as on the wire
  std::string stages_json;  // how it is published and its stages, in order (proto/README.md)
  std::uint64_t first_item = 0;
};

// The numbers that the next frame and the next sample of a stream get.
struct StreamPlace {
  std::uint32_t stream = 0;
  std::uint64_t next_frame = 0;
  std::uint64_t next_sample = 0;
};

// Table chunk: what one read gave, before decoding, and what else changes how it is decoded.
struct ChunkRow {
  std::int64_t id = 0;  // given by the writer
  std::uint32_t source = 0;
  std::uint32_t socket = 0;    // of the source's
  std::uint8_t direction = 0;  // posed::pipeline::Direction
  std::int64_t arrival_ns = 0;
  std::uint64_t first_item = 0;  // what the first item made from it is counted
  // Of each stream of the source: a reader finds its place after a gap. From a reader, these and
  // the bytes are valid until its next call.
  std::span<const StreamPlace> places{};
  std::span<const std::byte> bytes{};
};

// Table decision: what the pipeline decided and decoding cannot repeat. (stage, name) say what, a
// posed.v1.DecisionValue (proto/wire/posed/v1/log.proto) how much.
struct DecisionRow {
  std::int64_t id = 0;     // given by the writer
  std::uint64_t item = 0;  // takes effect just before this item
  std::uint32_t stream = 0;
  std::string stage;  // empty: the engine itself
  std::string name;
  std::string value;  // serialized
  std::int64_t now_ns = 0;
  // Only from formats 1 and 2, which did not count items: it takes effect just before this frame of
  // its stream.
  std::uint64_t before_frame = 0;
};

// Table frame, only when published frames were asked for: a posed.v1.Frame without stage stamps.
struct FrameRow {
  std::uint32_t stream = 0;
  std::uint64_t sequence = 0;
  bool raw = false;  // the unstyled input
  std::span<const std::byte> bytes{};
};

// Table gap: something the log lacks, so that nobody takes it for whole.
struct GapRow {
  enum class Kind : std::uint8_t { kChunks = 0, kDecisions = 1, kFrames = 2 };
  Kind kind = Kind::kChunks;
  std::uint32_t owner = 0;       // the source that lacks chunks; else the stream
  std::int64_t after_chunk = 0;  // id of the source's last chunk before it; 0 when there is none
  std::uint64_t lost = 0;
  std::int64_t time_ns = 0;  // when it was noticed
};

// Table take: an interval that somebody marked.
struct TakeRow {
  std::int64_t id = 0;
  std::string name;
  std::uint64_t first_item = 0;
  std::uint64_t last_item = 0;
};

// How (stage, name) of a decision are spelled.
namespace words {
inline constexpr const char* kEngine = "";
inline constexpr const char* kShed = "shed";                 // a range of frames
inline constexpr const char* kShedSamples = "shed-samples";  // a range of samples
inline constexpr const char* kTick = "tick";                 // at now_ns
inline constexpr const char* kEnd = "end";                   // the stream has ended, at now_ns
inline constexpr const char* kStyle = "style";
inline constexpr const char* kAlpha = "alpha";  // of style: a number
inline constexpr const char* kModel = "model";  // of style and generate: a sha256
inline constexpr const char* kGenerate = "generate";
inline constexpr const char* kPlay = "play";  // of generate: a play order
inline constexpr const char* kStopPlaying = "stop-playing";
inline constexpr const char* kConstrain = "constrain";
}  // namespace words

}  // namespace posed::log
