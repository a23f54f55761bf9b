#include "drivers/chain/protocol.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <sstream>
#include <string_view>

#include "proto/message/wire_reader.hpp"
#include "proto/text/number.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::drivers::chain {
namespace {

using message::WireField;
using message::WireReader;
using message::WireType;

constexpr double kMaxRate_hz = 1000.0;
constexpr std::string_view kPrefix = "posed stream=";

// The field numbers of posed.v1.Frame.
enum FrameField : std::uint32_t {
  kSequence = 2,
  kArrival = 4,
  kSkeletonId = 7,
  kRootPosition = 8,
  kRotation = 9,
  kValidity = 10,
  kAngle = 11,
  kQuality = 12,
  kSource = 13,
  kLabel = 14,
  kLabelProbability = 15,
  kLagFrames = 16,
  kLag = 17,
  kTimecode = 22
};
// The field number of posed.v1.Skeleton that is read here.
constexpr std::uint32_t kSkeletonStream = 1;

// Adds one number or several packed ones; false if they do not fit.
template <std::size_t N>
RT_SAFE bool read_floats(const WireField& field, FloatList<N>& list) noexcept {
  if (field.type == WireType::kFixed32) {
    if (list.count == N) return false;
    list.values[list.count++] = field.as_float();
    return true;
  }
  const std::size_t count = field.bytes.size() / sizeof(float);
  const bool whole = field.type == WireType::kBytes && field.bytes.size() % sizeof(float) == 0;
  if (!whole || count > N - list.count) return false;
  if (count > 0) std::memcpy(&list.values[list.count], field.bytes.data(), field.bytes.size());
  list.count += count;
  return true;
}

RT_SAFE bool read_number(const WireField& field, std::uint64_t& value) noexcept {
  value = field.value;
  return field.type == WireType::kVarint;
}

RT_SAFE bool read_float(const WireField& field, float& value) noexcept {
  value = field.as_float();
  return field.type == WireType::kFixed32;
}

// False for a field of another type than the schema's, or too long a list.
RT_SAFE bool read_field(const WireField& field, UpstreamFrame& frame) noexcept {
  switch (field.number) {
    case kSequence:
      return read_number(field, frame.sequence);
    case kArrival:
      frame.arrival_ns = static_cast<std::int64_t>(field.value);
      return field.type == WireType::kVarint;
    case kSkeletonId:
      frame.skeleton_id = static_cast<std::uint32_t>(field.value);
      return field.type == WireType::kFixed32;
    case kRootPosition:
      return read_floats(field, frame.root_position_m);
    case kRotation:
      return read_floats(field, frame.rotation_xyzw);
    case kValidity:
      frame.validity = field.bytes;
      return field.type == WireType::kBytes;
    case kAngle:
      return read_floats(field, frame.angle_rad);
    case kQuality:
      return read_number(field, frame.quality);
    case kSource:
      return read_number(field, frame.source);
    case kLabel:
      frame.label = field.text();
      return field.type == WireType::kBytes;
    case kLabelProbability:
      return read_float(field, frame.label_probability);
    case kLagFrames:
      return read_number(field, frame.lag_frames);
    case kLag:
      return read_float(field, frame.lag_ms);
    case kTimecode:
      frame.timecode = field.text();
      return field.type == WireType::kBytes;
    default:
      return true;
  }
}

}  // namespace

RT_SAFE bool split_message(std::span<const std::byte> chunk, UpstreamMessage& message) noexcept {
  const auto end = std::ranges::find(chunk, std::byte{0});
  if (end == chunk.end()) return false;
  const std::size_t size = end - chunk.begin();
  message.topic = {reinterpret_cast<const char*>(chunk.data()), size};
  message.body = chunk.subspan(size + 1);
  return true;
}

std::vector<std::byte> join_message(std::string_view topic, std::string_view body) {
  std::vector<std::byte> chunk;
  for (const std::string_view part : {topic, std::string_view("\0", 1), body}) {
    const auto bytes = std::as_bytes(std::span(part));
    chunk.insert(chunk.end(), bytes.begin(), bytes.end());
  }
  return chunk;
}

RT_SAFE Outcome read_frame(std::span<const std::byte> body, UpstreamFrame& frame) noexcept {
  WireReader fields(body);
  WireField field;
  while (fields.next(field)) {
    if (!read_field(field, frame)) return Outcome::kOutOfRange;
  }
  return fields.ok() ? Outcome::kOk : Outcome::kShort;
}

RT_SAFE bool is_of_other_stream(std::span<const std::byte> skeleton,
                                std::string_view stream) noexcept {
  WireReader fields(skeleton);
  WireField field;
  bool other = false;
  while (fields.next(field)) {
    if (field.number == kSkeletonStream) other = field.text() != stream;  // the last one counts
  }
  return other;
}

std::string device_info_text(const UpstreamInfo& info) {
  std::ostringstream text;
  text << kPrefix << info.stream << " rate=" << info.rate_hz;
  return text.str();
}

Result<UpstreamInfo> parse_device_info(const std::string& text, const std::string& identity) {
  UpstreamInfo info;
  const auto rate = text.find(" rate=");
  if (text.starts_with(kPrefix) && rate != std::string::npos) {
    info.stream = text.substr(kPrefix.size(), rate - kPrefix.size());
    info.rate_hz = exact_number<double>(std::string_view(text).substr(rate + 6)).value_or(0.0);
    const bool valid = info.rate_hz > 0.0 && info.rate_hz <= kMaxRate_hz;
    if (valid && is_upstream_stream(info.stream)) return info;
  }
  return fail(
      "is not described as a posed stream ('posed stream=ann rate=60'); is it another"
      " device?",
      identity);
}

bool is_upstream_stream(std::string_view name) {
  return !name.empty() && name.size() <= kMaxStreamName + kRawSuffix.size() &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string_view::npos;
}

}  // namespace posed::drivers::chain
