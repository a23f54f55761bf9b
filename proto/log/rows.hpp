// The rows of a device log, one struct per table. Ids give the order of rows within
// a table. All times are the recording host's CLOCK_MONOTONIC [ns]. The ids of sources and streams
// are names, not indices: they need not be consecutive.
//
// An item is a frame, a sample or a stream event on its way from the reader to the pipeline. Items
// are counted from 1 over all streams, including dropped ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

namespace posed::log {

// Streams of one log. Bodies that come and go all the time make many: each at most two a second.
inline constexpr std::size_t kMaxStreams = 65536;

// Table source: a device that was open when recording began, with everything needed to decode its
// chunks again.
struct SourceRow {
  std::uint32_t id = 0;
  std::string name;
  std::string driver;    // registry name
  std::string text;      // the device info, which is an input of the decoder
  std::string identity;  // path or serial number
  std::string config;    // the driver's options as JSON, every default filled in
};

// Table stream: one body of a source, from a given item on.
struct StreamRow {
  std::uint32_t id = 0;
  std::uint32_t source = 0;
  std::string body;              // its name in the source; empty if the source has only one body
  std::string name;              // name on the wire
  std::string stages_json;       // how it is published, and its stages in order (proto/README.md)
  std::uint64_t first_item = 0;  // 0: the log lacks the rows that would say it
};

// The numbers of the next frame and the next sample of a stream.
struct StreamPosition {
  std::uint32_t stream = 0;
  std::uint64_t next_frame = 0;
  std::uint64_t next_sample = 0;
};

// Table chunk: the bytes of one read, before decoding, or another change to how bytes are decoded.
struct ChunkRow {
  std::int64_t id = 0;  // set by the writer
  std::uint32_t source = 0;
  std::uint32_t socket = 0;    // number of the socket within the source
  std::uint8_t direction = 0;  // posed::pipeline::Direction
  std::int64_t arrival_ns = 0;
  std::uint64_t first_item = 0;  // number of the first item made from it
  // For each stream of the source, so that a reader can resume after a gap. In a row from a reader,
  // these and the bytes are valid until its next call.
  std::span<const StreamPosition> places{};
  std::span<const std::byte> bytes{};
};

// Table decision: a choice of the pipeline that decoding alone cannot reproduce. (stage, name) give
// its kind; a posed.v1.DecisionValue (proto/wire/posed/v1/log.proto) holds its value.
struct DecisionRow {
  std::int64_t id = 0;     // set by the writer
  std::uint64_t item = 0;  // takes effect just before this item
  std::uint32_t stream = 0;
  std::string stage;  // empty: the stream engine itself
  std::string name;
  std::string value;  // serialized
  std::int64_t now_ns = 0;
};

// Table frame, only if recording frames was requested: a posed.v1.Frame without stage stamps.
struct FrameRow {
  std::uint32_t stream = 0;
  std::uint64_t sequence = 0;
  bool raw = false;  // the input before styling
  std::span<const std::byte> bytes{};
};

// Table gap: something that the log lacks, so that a reader knows it is incomplete.
struct GapRow {
  enum class Kind : std::uint8_t { kChunks = 0, kDecisions = 1, kFrames = 2 };
  Kind kind = Kind::kChunks;
  std::uint32_t owner = 0;       // the source that lacks chunks; for other kinds the stream
  std::int64_t after_chunk = 0;  // id of the source's last chunk before it; 0 when there is none
  std::uint64_t lost = 0;
  std::int64_t time_ns = 0;  // when the gap was noticed
};

// The last item of a take that was still running when the recording ended: the largest number of
// the column, so that a comparison with it needs no special case.
inline constexpr std::uint64_t kToTheEnd = std::numeric_limits<std::int64_t>::max();

// Of a recording. A trigger alone needs days to reach it (daemon/control/trigger.hpp).
inline constexpr std::uint32_t kMaxTakes = 99'999;

// Table take: an interval marked by a user.
struct TakeRow {
  std::int64_t id = 0;  // the take's number, 1 to kMaxTakes
  std::string name;
  std::uint64_t first_item = 0;
  std::uint64_t last_item = 0;  // below first_item: nothing came; kToTheEnd: it was never ended
  std::string timecode{};       // at its beginning, where another system told it
};

// Spelling of the (stage, name) of decisions.
namespace words {
inline constexpr const char* kEngine = "";
inline constexpr const char* kShed = "shed";                 // a range of frames
inline constexpr const char* kShedSamples = "shed-samples";  // a range of samples
inline constexpr const char* kTick = "tick";                 // at now_ns
inline constexpr const char* kEnd = "end";                   // the stream has ended, at now_ns
inline constexpr const char* kModel = "model";  // a new model of style or generate: its SHA-256
}  // namespace words

}  // namespace posed::log
