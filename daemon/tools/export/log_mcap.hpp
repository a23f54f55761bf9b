// Turns a whole device log into an MCAP file: replays it and writes what the run published. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/byte_writer.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// McapWriter: writes MCAP (https://mcap.dev/spec), the container of messages that robotics viewers
// open. Messages are collected into chunks with indexes, so that a viewer reads only the part of
// the time that it shows. Chunks are not compressed: every reader can read them, and poses of
// floats hardly shrink. Cold.
// One thread. Memory: one chunk, and some 100 bytes for each chunk written.
//  Errors of writing stay in the stream.
class McapWriter {
 public:
  static constexpr std::size_t kMaxChannels = 65535;  // a channel's number has 16 bits

  // Writes the header. `out` outlives the writer.
  McapWriter(std::ostream& out, std::string_view library);

  // A kind of messages: its protobuf name, and a serialized google.protobuf.FileDescriptorSet with
  // the file that defines it and all that this one imports. Returns its number.
  std::uint16_t add_schema(std::string_view name, std::string_view descriptors);
  // At most kMaxChannels. Returns its number.
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic);

  // Times in ns from 1970, or from any other zero; they need not increase.
  void add(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
           std::string_view message);

  // Writes the rest, and what readers look up first: the indexes, the counts. Call once, at the
  // end.
  void finish();

  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  [[nodiscard]] std::size_t channels() const noexcept { return channels_.size(); }

 private:
  using Bytes = drivers::ByteWriter;
  struct ChunkIndex {
    std::uint64_t first_ns = 0, last_ns = 0;
    std::uint64_t start = 0, length = 0;             // of the chunk's record
    std::map<std::uint16_t, std::uint64_t> index{};  // [channel], where its message index is
    std::uint64_t index_length = 0, size = 0;
  };

  void write(std::span<const std::byte> bytes);
  void record(std::uint8_t opcode, Bytes content);
  void end_chunk();
  void write_summary();
  void write_statistics();
  void write_chunk_indexes();

  std::ostream& out_;
  std::uint64_t place_ = 0;                                 // bytes written
  std::uint32_t crc_ = 0;                                   // of the section's bytes
  std::vector<std::vector<std::byte>> schemas_, channels_;  // contents of their records
  std::map<std::uint16_t, std::uint64_t> counts_;           // [channel]
  std::uint64_t messages_ = 0;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;

  // The chunk that is being filled.
  Bytes chunk_;
  std::uint64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0;
  using Entries = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // time, place in the chunk
  std::map<std::uint16_t, Entries> entries_;                             // [channel]
  std::vector<ChunkIndex> chunks_;
};

struct McapSummary {
  std::uint64_t messages = 0;
  std::size_t topics = 0;
  std::vector<std::string> warnings;  // one sentence for each thing that the file lacks
};

// Writes pose/<stream>, skeleton/<stream>, sensor/<stream> and event/<stream> of every stream, in
// the order in which they were published, as protobuf messages whose schema is in the file; and
// tf/<stream>, the poses again as foxglove.FrameTransforms, which a 3D view shows (ros_frames). The
// time of a message is its arrival or that of the event, in UTC if the log knows how its clock
// relates to it. A pose that was repeated while its stream was stale is left out, and so are events
// that no pipeline made: takes, devices that come and go, the recorder's own. Frames go to the file
// as they are computed, so the memory does not grow with the log. `stop` is asked before each chunk
// of the log; true ends the writing with an error and without a file.
Result<McapSummary> write_mcap(const std::filesystem::path& log, const std::filesystem::path& path,
                               const std::function<bool()>& stop);

}  // namespace posed::tools
