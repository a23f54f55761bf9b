#include "daemon/replay/log_mcap.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <set>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "daemon/publish/event_text.hpp"
#include "daemon/publish/published_stream.hpp"
#include "daemon/replay/mcap_writer.hpp"
#include "daemon/replay/replay.hpp"
#include "daemon/replay/stream_info.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::replay {
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
  const std::string& text = found->second;
  std::int64_t offset_ns = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), offset_ns);
  // The sum with a time of the log must fit.
  constexpr std::int64_t kMost_ns = std::numeric_limits<std::int64_t>::max() / 2;
  const bool plausible = error == std::errc() && end == text.data() + text.size() &&
                         offset_ns >= 0 && offset_ns <= kMost_ns;
  return plausible ? std::optional(offset_ns) : std::nullopt;
}

// Writes the items of a replay.
class LogToMcap {
 public:
  LogToMcap(const Replay& replay, std::int64_t offset_ns, std::ostream& out)
      : replay_(replay),
        offset_ns_(offset_ns),
        writer_(out, "posed"),
        frame_schema_(add_schema(*v1::Frame::descriptor())),
        skeleton_schema_(add_schema(*v1::Skeleton::descriptor())),
        sample_schema_(add_schema(*v1::Sample::descriptor())),
        event_schema_(add_schema(*v1::Event::descriptor())),
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
        : channel(name, info, unstyled) {}
    publish::Channel channel;
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
      const ReplayStream& stream = replay_.stream(id);
      place = std::make_unique<Named>(raw ? raw_name(stream.name) : stream.name,
                                      stream_info(id, stream), raw);
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
    const std::int64_t utc_ns = is_possible_time(time_ns) ? time_ns + offset_ns_ : offset_ns_;
    writer_.add(found->second, static_cast<std::uint32_t>(sequence),
                static_cast<std::uint64_t>(utc_ns), bytes_);
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
    const ReplayStream& stream = replay_.stream(event.stream);
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

  const Replay& replay_;
  std::int64_t offset_ns_;
  McapWriter writer_;
  std::uint16_t frame_schema_, skeleton_schema_, sample_schema_, event_schema_;
  std::vector<Part> parts_;  // [stream]
  std::map<std::string, std::uint16_t> topics_;
  std::string bytes_;
  std::uint64_t left_out_ = 0;
};

void warn_of_gaps(const Replay& replay, std::vector<std::string>& warnings) {
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
  auto reader = log::Reader::open(log);
  if (!reader) return std::unexpected(reader.error());
  auto opened = Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  Replay& replay = **opened;
  McapSummary summary;
  const auto offset_ns = utc_offset_ns(*reader);
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

}  // namespace posed::replay
