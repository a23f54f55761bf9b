#include "daemon/tools/export/log_mcap.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <ostream>
#include <set>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "daemon/publish/event_text.hpp"
#include "daemon/publish/published_stream.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "daemon/tools/replay/stream_info.hpp"
#include "models/motion/ros_frames.hpp"
#include "posed/foxglove/frame_transforms.pb.h"
#include "proto/frame/whole_file.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/number.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::tools {
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

namespace {

using google::protobuf::FileDescriptor;
using google::protobuf::FileDescriptorSet;

// Imported files come before those that import them.
void add_file(const FileDescriptor& file, std::set<std::string>& added, FileDescriptorSet& set) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), added, set);
  file.CopyTo(set.add_file());
}

std::string descriptors_of(const google::protobuf::Descriptor& message) {
  FileDescriptorSet set;
  std::set<std::string> added;
  add_file(*message.file(), added, set);
  return set.SerializeAsString();
}

// What to add to the log's times to have UTC; empty if the log does not say.
std::optional<std::int64_t> utc_offset_ns(const log::Reader& reader) {
  const auto found = reader.meta().find("monotonic_to_utc_ns");
  if (found == reader.meta().end()) return std::nullopt;
  const auto offset_ns = exact_number<std::int64_t>(found->second);
  // The sum with a time of the log must fit.
  constexpr std::int64_t kMaxTime_ns = std::numeric_limits<std::int64_t>::max() / 2;
  return offset_ns && *offset_ns >= 0 && *offset_ns <= kMaxTime_ns ? offset_ns : std::nullopt;
}

// Writes the items of a replay.
class LogToMcap {
 public:
  LogToMcap(const replay::Replay& replay, std::int64_t offset_ns, std::ostream& out)
      : replay_(replay),
        offset_ns_(offset_ns),
        writer_(out, "posed"),
        frame_schema_(add_schema(*v1::Frame::descriptor())),
        skeleton_schema_(add_schema(*v1::Skeleton::descriptor())),
        sample_schema_(add_schema(*v1::Sample::descriptor())),
        event_schema_(add_schema(*v1::Event::descriptor())),
        transforms_schema_(add_schema(*foxglove::FrameTransforms::descriptor())),
        parts_(replay.streams()) {}

  void add(const pipeline::Item& item) {
    switch (item.kind) {
      case pipeline::Item::Kind::kFrame:
      case pipeline::Item::Kind::kRawFrame:
        take_frame(item.frame, item.kind == pipeline::Item::Kind::kRawFrame);
        break;
      case pipeline::Item::Kind::kSample:
        take_sample(item.sample);
        break;
      case pipeline::Item::Kind::kEvent:
        take_event(item.stream_event);
        break;
    }
  }

  void finish() { writer_.finish(); }
  [[nodiscard]] std::uint64_t messages() const { return writer_.messages(); }
  [[nodiscard]] std::size_t topics() const { return writer_.channels(); }
  // Messages of topics for which MCAP has no number left.
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }

 private:
  // A stream of the log under one of its two names.
  struct Named {
    Named(const std::string& name, const publish::StreamInfo& info, bool unstyled)
        : channel(name, info, unstyled),
          skeleton(unstyled ? info.description.skeleton : info.skeleton),
          tf_topic("tf/" + name) {
      if (skeleton != nullptr) frame_names = motion::ros_frame_names(name, *skeleton);
    }
    publish::Channel channel;
    std::shared_ptr<const Skeleton> skeleton;  // null if it has none
    std::string tf_topic;
    std::vector<std::string> frame_names;  // [joint]
    std::uint64_t last_frame = 0, last_sample = 0;
  };
  struct Part {
    std::unique_ptr<Named> styled, raw;
  };

  std::uint16_t add_schema(const google::protobuf::Descriptor& message) {
    return writer_.add_schema(message.full_name(), descriptors_of(message));
  }

  Named& named(std::uint32_t id, bool raw) {
    auto& place = raw ? parts_[id].raw : parts_[id].styled;
    if (place == nullptr) {
      const replay::ReplayStream& stream = replay_.stream(id);
      place = std::make_unique<Named>(raw ? raw_name(stream.name) : stream.name,
                                      replay::stream_info(id, stream), raw);
    }
    return *place;
  }

  void add(const std::string& topic, std::uint16_t schema, std::uint64_t sequence,
           std::int64_t time_ns, const google::protobuf::MessageLite& message) {
    auto found = topics_.find(topic);
    if (found == topics_.end()) {
      if (writer_.channels() == McapWriter::kMaxChannels) {
        ++left_out_;
        return;
      }
      found = topics_.emplace(topic, writer_.add_channel(schema, topic)).first;
    }
    message.SerializeToString(&bytes_);
    writer_.add(found->second, static_cast<std::uint32_t>(sequence),
                static_cast<std::uint64_t>(utc_of(time_ns)), bytes_);
  }

  [[nodiscard]] std::int64_t utc_of(std::int64_t time_ns) const {
    return replay::is_possible_time(time_ns) ? time_ns + offset_ns_ : offset_ns_;
  }

  void take_frame(const Frame& frame, bool raw) {
    const Header& header = frame.header;
    Named& from = named(header.stream, raw);
    if (header.sequence <= from.last_frame) return;  // repeated while the stream was stale
    if (from.last_frame == 0 && from.channel.skeleton) {
      add(from.channel.skeleton_topic, skeleton_schema_, 0, header.arrival_ns,
          *from.channel.skeleton);
    }
    from.last_frame = header.sequence;
    add(from.channel.pose_topic, frame_schema_, header.sequence, header.arrival_ns,
        from.channel.frames.encode(frame));
    if (from.skeleton == nullptr || frame.joint_count != from.frame_names.size()) return;
    fill_transforms(from, frame);
    add(from.tf_topic, transforms_schema_, header.sequence, header.arrival_ns, transforms_);
  }

  void fill_transforms(const Named& from, const Frame& frame) {
    const auto frames = motion::ros_frames(*from.skeleton, frame);
    const std::int64_t utc_ns = utc_of(frame.header.arrival_ns);
    transforms_.Clear();  // keeps its memory
    for (std::size_t j = 0; j < frames.size(); ++j) {
      foxglove::FrameTransform& one = *transforms_.add_transforms();
      one.mutable_timestamp()->set_seconds(utc_ns / kNanosPerSecond);
      one.mutable_timestamp()->set_nanos(static_cast<std::int32_t>(utc_ns % kNanosPerSecond));
      const int parent = from.skeleton->joints[j].parent;
      one.set_parent_frame_id(parent < 0 ? motion::kRosWorld : from.frame_names[parent]);
      one.set_child_frame_id(from.frame_names[j]);
      const auto& [at, turn] = frames[j];
      one.mutable_translation()->set_x(at.x());
      one.mutable_translation()->set_y(at.y());
      one.mutable_translation()->set_z(at.z());
      one.mutable_rotation()->set_x(turn.x());
      one.mutable_rotation()->set_y(turn.y());
      one.mutable_rotation()->set_z(turn.z());
      one.mutable_rotation()->set_w(turn.w());
    }
  }

  void take_sample(const Sample& sample) {
    const Header& header = sample.header;
    Named& from = named(header.stream, false);
    if (header.sequence <= from.last_sample) return;
    from.last_sample = header.sequence;
    add(from.channel.sensor_topic, sample_schema_, header.sequence, header.arrival_ns,
        from.channel.samples.encode(sample));
  }

  void take_event(const pipeline::StreamEvent& event) {
    const replay::ReplayStream& stream = replay_.stream(event.stream);
    const auto kind = static_cast<v1::Event::Kind>(event.kind);
    std::string text = publish::sentence(event);
    if (kind == v1::Event::KIND_SHED) {
      const auto frames = static_cast<std::uint64_t>(event.value);
      text = publish::sentence(
          publish::ShedTally::Sum{frames, event.sequence, event.sequence + frames - 1});
    } else if (kind == v1::Event::KIND_ENDED && !stream.source.empty()) {
      text = publish::has_left(stream.source, stream.body, event.sequence);
    }
    add(named(event.stream, false).channel.event_topic, event_schema_, event.sequence,
        event.time_ns,
        publish::event_message(stream.name, kind, event.time_ns, event.sequence, text));
  }

  const replay::Replay& replay_;
  std::int64_t offset_ns_;
  McapWriter writer_;
  std::uint16_t frame_schema_, skeleton_schema_, sample_schema_, event_schema_, transforms_schema_;
  std::vector<Part> parts_;  // [stream]
  std::map<std::string, std::uint16_t> topics_;
  std::string bytes_;
  foxglove::FrameTransforms transforms_;
  std::uint64_t left_out_ = 0;
};

void warn_of_gaps(const replay::Replay& replay, std::vector<std::string>& warnings) {
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const auto broken = replay.broken_at(id);
    if (!broken) continue;
    warnings.push_back("stream " + in_quotes(replay.stream(id).name) +
                       ": the log is known to lack data from frame " + std::to_string(*broken) +
                       " on");
  }
}

}  // namespace

Result<McapSummary> write_mcap(const std::filesystem::path& log, const std::filesystem::path& path,
                               const std::function<bool()>& stop) {
  auto reader = TRY(log::Reader::open(log));
  auto opened = TRY(replay::Replay::open(reader));
  replay::Replay& replay = *opened;
  McapSummary summary;
  const auto offset_ns = utc_offset_ns(reader);
  if (!offset_ns) {
    summary.warnings.emplace_back(
        "the log does not say when it was made, so times count from the start of its computer");
  }
  Result<> replayed;
  const auto written = write_whole_file(path, [&](std::ostream& file) {
    LogToMcap to(replay, offset_ns.value_or(0), file);
    bool stopped = false;
    replayed = replay.run([&](const pipeline::Item& item) { to.add(item); },
                          [&](const log::ChunkRow&) {
                            stopped = stopped || stop();
                            return !stopped && file.good();
                          });
    if (replayed && stopped) replayed = fail("was not written: interrupted", path.string());
    if (!replayed) file.setstate(std::ios::failbit);  // leaves no file
    to.finish();
    summary.messages = to.messages();
    summary.topics = to.topics();
    if (to.left_out() > 0) {
      summary.warnings.push_back(std::to_string(to.left_out()) +
                                 " messages are left out: MCAP counts at most " +
                                 std::to_string(McapWriter::kMaxChannels) + " topics");
    }
  });
  if (!replayed) return std::unexpected(replayed.error());
  if (!written) return std::unexpected(written.error());
  warn_of_gaps(replay, summary.warnings);
  return summary;
}

}  // namespace posed::tools
