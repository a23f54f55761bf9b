#include "daemon/tools/export/mcap_writer.hpp"

#include <algorithm>
#include <ostream>

#include <zlib.h>

namespace posed::replay {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 1 << 20;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

using Bytes = drivers::ByteWriter;

void add_text(Bytes& bytes, std::string_view text) {
  bytes.u32(static_cast<std::uint32_t>(text.size()));
  bytes.text(text);
}

void add_map(Bytes& bytes, const std::map<std::uint16_t, std::uint64_t>& map) {
  bytes.u32(static_cast<std::uint32_t>(map.size() * 10));
  for (const auto& [key, value] : map) {
    bytes.u16(key);
    bytes.u64(value);
  }
}

std::uint32_t crc_of(std::uint32_t crc, std::span<const std::byte> bytes) {
  if (bytes.empty()) return crc;  // zlib takes a null pointer as a request to start anew
  return static_cast<std::uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

McapWriter::McapWriter(std::ostream& out, std::string_view library) : out_(out) {
  write(std::as_bytes(std::span(kMagic)));
  Bytes header;
  add_text(header, "");  // no profile of conventions
  add_text(header, library);
  record(kHeader, std::move(header));
}

void McapWriter::write(std::span<const std::byte> bytes) {
  out_.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  place_ += bytes.size();
  crc_ = crc_of(crc_, bytes);
}

void McapWriter::record(std::uint8_t opcode, Bytes content) {
  Bytes head;
  head.u8(opcode);
  head.u64(content.size());
  write(head.written());
  write(content.written());
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view descriptors) {
  const auto number = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0: no schema
  Bytes schema;
  schema.u16(number);
  add_text(schema, name);
  add_text(schema, "protobuf");
  add_text(schema, descriptors);
  schemas_.push_back(schema.written());
  record(kSchema, std::move(schema));
  return number;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic) {
  const auto number = static_cast<std::uint16_t>(channels_.size());
  Bytes channel;
  channel.u16(number);
  channel.u16(schema);
  add_text(channel, topic);
  add_text(channel, "protobuf");
  channel.u32(0);  // no metadata
  channels_.push_back(channel.written());
  record(kChannel, std::move(channel));
  return number;
}

void McapWriter::add(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                     std::string_view message) {
  constexpr std::uint64_t kBeforeData = 2 + 4 + 8 + 8;
  const bool first = chunk_.size() == 0;
  chunk_first_ns_ = first ? time_ns : std::min(chunk_first_ns_, time_ns);
  chunk_last_ns_ = first ? time_ns : std::max(chunk_last_ns_, time_ns);
  entries_[channel].emplace_back(time_ns, chunk_.size());
  chunk_.u8(kMessage);
  chunk_.u64(kBeforeData + message.size());
  chunk_.u16(channel);
  chunk_.u32(sequence);
  chunk_.u64(time_ns);  // when it was taken
  chunk_.u64(time_ns);  // when it was published: the same, because a replay does not know it
  chunk_.text(message);
  ++counts_[channel];
  ++messages_;
  if (chunk_.size() >= kChunkBytes) end_chunk();
}

// Behind the chunk come the places of its messages, channel by channel.
void McapWriter::end_chunk() {
  if (chunk_.size() == 0) return;
  first_ns_ = chunks_.empty() ? chunk_first_ns_ : std::min(first_ns_, chunk_first_ns_);
  last_ns_ = std::max(last_ns_, chunk_last_ns_);
  ChunkIndex index{.first_ns = chunk_first_ns_, .last_ns = chunk_last_ns_, .start = place_};
  index.size = chunk_.size();
  Bytes head;
  head.u64(chunk_first_ns_);
  head.u64(chunk_last_ns_);
  head.u64(chunk_.size());
  head.u32(crc_of(0, chunk_.written()));
  add_text(head, "");  // not compressed
  head.u64(chunk_.size());
  Bytes opening;
  opening.u8(kChunk);
  opening.u64(head.size() + chunk_.size());
  write(opening.written());
  write(head.written());
  write(chunk_.written());
  index.length = place_ - index.start;
  const std::uint64_t indexes = place_;
  for (const auto& [channel, entries] : entries_) {
    index.index[channel] = place_;
    Bytes message_index;
    message_index.u16(channel);
    message_index.u32(static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [time_ns, offset] : entries) {
      message_index.u64(time_ns);
      message_index.u64(offset);
    }
    record(kMessageIndex, std::move(message_index));
  }
  index.index_length = place_ - indexes;
  chunks_.push_back(std::move(index));
  chunk_.written().clear();  // keeps its memory
  entries_.clear();
}

void McapWriter::finish() {
  end_chunk();
  Bytes data_end;
  data_end.u32(crc_);
  record(kDataEnd, std::move(data_end));
  write_summary();
}

void McapWriter::write_statistics() {
  Bytes statistics;
  statistics.u64(messages_);
  statistics.u16(static_cast<std::uint16_t>(schemas_.size()));
  statistics.u32(static_cast<std::uint32_t>(channels_.size()));
  statistics.u32(0);  // attachments
  statistics.u32(0);  // metadata
  statistics.u32(static_cast<std::uint32_t>(chunks_.size()));
  statistics.u64(first_ns_);
  statistics.u64(last_ns_);
  add_map(statistics, counts_);
  record(kStatistics, std::move(statistics));
}

void McapWriter::write_chunk_indexes() {
  for (const ChunkIndex& chunk : chunks_) {
    Bytes index;
    index.u64(chunk.first_ns);
    index.u64(chunk.last_ns);
    index.u64(chunk.start);
    index.u64(chunk.length);
    add_map(index, chunk.index);
    index.u64(chunk.index_length);
    add_text(index, "");  // not compressed
    index.u64(chunk.size);
    index.u64(chunk.size);
    record(kChunkIndex, std::move(index));
  }
}

// The summary has the records that a reader needs before it reads a chunk, in groups of one kind;
// then where each group is; then the footer, which says where the summary is.
void McapWriter::write_summary() {
  const std::uint64_t summary = place_;
  crc_ = 0;
  std::vector<Bytes> groups;
  const auto group = [&](std::uint8_t opcode, const auto& write_records) {
    const std::uint64_t start = place_;
    write_records();
    if (place_ == start) return;
    Bytes offset;
    offset.u8(opcode);
    offset.u64(start);
    offset.u64(place_ - start);
    groups.push_back(std::move(offset));
  };
  const auto write_again = [this](std::uint8_t opcode, const auto& contents) {
    for (const std::vector<std::byte>& content : contents) {
      Bytes bytes;
      bytes.bytes(content);
      record(opcode, std::move(bytes));
    }
  };
  group(kSchema, [&] { write_again(kSchema, schemas_); });
  group(kChannel, [&] { write_again(kChannel, channels_); });
  group(kStatistics, [&] { write_statistics(); });
  group(kChunkIndex, [&] { write_chunk_indexes(); });
  const std::uint64_t summary_offsets = place_;
  for (Bytes& offset : groups) record(kSummaryOffset, std::move(offset));
  // The checksum covers the footer up to the checksum itself.
  Bytes footer;
  footer.u8(kFooter);
  footer.u64(8 + 8 + 4);
  footer.u64(summary);
  footer.u64(summary_offsets);
  const std::uint32_t crc = crc_of(crc_, footer.written());
  footer.u32(crc);
  write(footer.written());
  write(std::as_bytes(std::span(kMagic)));
}

}  // namespace posed::replay
