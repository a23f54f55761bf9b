#include "daemon/tools/replay/expectation.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>
#include <spdlog/fmt/fmt.h>

#include "proto/text/stream_name.hpp"

namespace posed::replay {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

// A single field of the frame, serialized.
std::string bytes_of_field(const v1::Frame& frame, const FieldDescriptor* field) {
  v1::Frame alone;
  const auto* descriptor = v1::Frame::descriptor();
  alone.CopyFrom(frame);
  for (int i = 0; i < descriptor->field_count(); ++i) {
    if (descriptor->field(i) != field) {
      v1::Frame::GetReflection()->ClearField(&alone, descriptor->field(i));
    }
  }
  return alone.SerializeAsString();
}

std::string print_field(const v1::Frame& frame, const FieldDescriptor* field, int index) {
  if (field->is_repeated() && index >= v1::Frame::GetReflection()->FieldSize(frame, field)) {
    return "nothing";
  }
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(frame, field,
                                                        field->is_repeated() ? index : -1, &text);
  return text;
}

// The index at which two repeated float fields differ: the first unequal element, or the end of the
// shorter field.
int first_index(const v1::Frame& live, const v1::Frame& replayed, const FieldDescriptor* field) {
  const Reflection* reflection = v1::Frame::GetReflection();
  const int count =
      std::min(reflection->FieldSize(live, field), reflection->FieldSize(replayed, field));
  for (int i = 0; i < count; ++i) {
    const auto one = std::bit_cast<std::uint32_t>(reflection->GetRepeatedFloat(live, field, i));
    const auto two = std::bit_cast<std::uint32_t>(reflection->GetRepeatedFloat(replayed, field, i));
    if (one != two) return i;
  }
  return count;
}

}  // namespace

std::string first_difference(const v1::Frame& live, const v1::Frame& replayed) {
  if (live.SerializeAsString() == replayed.SerializeAsString()) return {};
  const auto* descriptor = v1::Frame::descriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const FieldDescriptor* field = descriptor->field(i);
    if (bytes_of_field(live, field) == bytes_of_field(replayed, field)) continue;
    std::string place = field->name();
    int index = 0;
    if (field->is_repeated()) {
      index = first_index(live, replayed, field);
      place += fmt::format("[{}]", index);
    }
    return fmt::format("{}: {} live, {} replayed", place, print_field(live, field, index),
                       print_field(replayed, field, index));
  }
  return "a field this posed does not know";
}

Result<Expectation> Expectation::open(const log::Reader& reader) {
  const std::string& file = reader.file();
  const auto has_frames = TRY(reader.has_frames());
  if (!has_frames) {
    return fail(
        "holds no published frames to expect; the next one does by `posed record --frames`,"
        " or by [record] with frames = true (and its folder) in the config",
        file);
  }
  Expectation expectation(file);
  for (const log::StreamRow& row : reader.streams()) {
    Stream stream{.name = row.name, .channels = {}, .may_lack = 0};
    for (const bool raw : {false, true}) {
      auto frames = TRY(reader.frames(row.id, raw));
      stream.channels[raw].emplace(Channel{std::move(frames), std::nullopt, {}});
      TRY(expectation.advance(*stream.channels[raw]));
    }
    expectation.streams_.push_back(std::move(stream));
  }
  const auto gaps = TRY(reader.gaps());
  for (const log::GapRow& gap : gaps) {
    if (gap.kind == log::GapRow::Kind::kFrames) {
      expectation.streams_[*reader.place_of_stream(gap.owner)].may_lack += gap.lost;
    }
  }
  return expectation;
}

// Describes a live frame that the replay did not produce. A sequence may come twice (a pose is
// repeated), so a replayed frame that differs from it may correspond to another frame that the log
// lacks.
std::string Expectation::how_it_lacks(const Channel& channel) {
  return channel.difference.empty() ? "published live, but not replayed" : channel.difference;
}

Result<> Expectation::advance(Channel& channel) const {
  channel.difference.clear();
  const auto row = TRY(channel.frames.next());
  if (!row.has_value()) {
    channel.live.reset();
    return {};
  }
  channel.live.emplace();
  const auto bytes = row->bytes;
  if (!channel.live->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return fail(
        fmt::format("the log is damaged (published frame {} cannot be read)", row->sequence),
        file_);
  }
  return {};
}

Result<> Expectation::compare(std::uint32_t id, bool raw, const v1::Frame& replayed,
                              std::optional<std::uint64_t> broken_at) {
  Stream& stream = streams_[id];
  Channel& channel = *stream.channels[raw];
  const std::uint64_t sequence = replayed.sequence();
  if (broken_at && sequence >= *broken_at) {
    ++channel.after_gap;
    ++counts_.after_gap;
    return {};
  }
  if (!channel.live) {
    // A gap row may account for the last frames, too; otherwise the recording ended before they
    // were published.
    if (stream.may_lack > 0) {
      --stream.may_lack;
      ++counts_.lost;
    } else {
      ++counts_.past_end;
    }
    return {};
  }
  if (channel.live->sequence() < sequence) {
    return differs(stream, raw, channel.live->sequence(), how_it_lacks(channel));
  }
  const bool same_frame = channel.live->sequence() == sequence;
  if (same_frame) channel.difference = first_difference(*channel.live, replayed);
  if (same_frame && channel.difference.empty()) {
    ++counts_.compared;
    return advance(channel);
  }
  if (stream.may_lack > 0) {
    --stream.may_lack;
    ++counts_.lost;
    return {};
  }
  return differs(stream, raw, sequence,
                 same_frame ? channel.difference : "replayed, but not published live");
}

Result<> Expectation::finish(std::uint32_t id, std::optional<std::uint64_t> broken_at) {
  Stream& stream = streams_[id];
  for (const bool raw : {false, true}) {
    Channel& channel = *stream.channels[raw];
    std::uint64_t counted = channel.after_gap;  // a live frame and its replayed one are one frame
    while (channel.live) {
      if (!broken_at || channel.live->sequence() < *broken_at) {
        return differs(stream, raw, channel.live->sequence(), how_it_lacks(channel));
      }
      if (counted > 0) {
        --counted;
      } else {
        ++counts_.after_gap;
      }
      TRY(advance(channel));
    }
  }
  return {};
}

Result<> Expectation::check_compared() const {
  if (counts_.compared > 0) return {};
  const std::string why = counts_.not_compared();
  return fail("nothing could be compared" + (why.empty() ? why : ": " + why), file_);
}

Expectation::Counts& Expectation::Counts::operator+=(const Counts& other) {
  compared += other.compared;
  lost += other.lost;
  after_gap += other.after_gap;
  past_end += other.past_end;
  return *this;
}

std::string Expectation::Counts::not_compared() const {
  if (lost + after_gap + past_end == 0) return {};
  return fmt::format("{} frames that the log lacks, {} after a gap, {} past its end", lost,
                     after_gap, past_end);
}

Result<> Expectation::differs(const Stream& stream, bool raw, std::uint64_t sequence,
                              const std::string& how) const {
  return fail(fmt::format("stream {}, sequence {}, {}", raw ? raw_name(stream.name) : stream.name,
                          sequence, how),
              file_);
}

}  // namespace posed::replay
