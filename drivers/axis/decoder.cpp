#include "drivers/axis/decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::axis {
namespace {

constexpr std::int64_t kGone_ns = kNanosPerSecond;
constexpr std::int64_t kDescribeEvery_ns = kNanosPerSecond / 2;
// The lengths of a stream's bones waver by up to 0.5 cm, because the applications shift bones.
// Proportions that are set anew stay.
constexpr float kOtherLength_cm = 1.5F;
constexpr std::int64_t kSettled_ns = kNanosPerSecond;

// The time between two arrivals, which a damaged log may put anywhere.
RT_SAFE std::int64_t since(std::int64_t now_ns, std::int64_t then_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(now_ns) -
                                   static_cast<std::uint64_t>(then_ns));
}

RT_SAFE Proportions offsets_of(const Message& message) noexcept {
  Proportions offset_cm = default_proportions();
  for (std::size_t b = 1; b < kBones; ++b) {
    const double* const at = message.values.data() + rotations_at(message.content, b) - 3;
    offset_cm[b] = offset_from(
        b, {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
  }
  return offset_cm;
}

RT_SAFE bool other_lengths(const Proportions& a, const Proportions& b) noexcept {
  const auto length = [](const Vec3f& v) { return std::hypot(v[0], v[1], v[2]); };
  for (std::size_t i = 1; i < kBones; ++i) {
    if (std::abs(length(a[i]) - length(b[i])) > kOtherLength_cm) return true;
  }
  return false;
}

constexpr std::byte kMark{0xFF};  // the first byte of every header; no text contains it
constexpr std::byte kMotion{0xDD};
constexpr std::byte kCalculation{0x88};
constexpr std::byte kCalculationEnd{0x99};
constexpr std::size_t kCountAt = 6;  // the bytes before it are the same in all messages of a sender

RT_SAFE bool is_blank(std::byte byte) noexcept {
  const auto c = std::to_integer<unsigned>(byte);
  return c == ' ' || (c >= '\t' && c <= '\r');
}

RT_SAFE bool is_text(std::byte byte) noexcept {
  const auto c = std::to_integer<unsigned>(byte);
  return is_blank(byte) || (c > 0x20 && c != 0x7F && c != 0xFF);
}

Eigen::Vector3d metres(const Vec3f& cm) {
  const Eigen::Vector3d v(static_cast<double>(cm[0]), static_cast<double>(cm[1]),
                          static_cast<double>(cm[2]));
  return v * kCentimetre_m;
}

void add_channels(Skeleton& skeleton, bool positions, std::uint8_t order) {
  const auto joint = static_cast<std::uint16_t>(skeleton.joints.size() - 1);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    if (!positions) break;
    skeleton.channels.push_back({.joint = joint, .axis = axis, .translation = true});
  }
  for (const Axis axis : order_axes(order)) {
    skeleton.channels.push_back({.joint = joint, .axis = axis});
  }
}

// Other programs get the names in messages that must be UTF-8. A name that another body has already
// differs by the avatar's number.
std::string body_name(const Avatar& avatar, const std::vector<Body>& bodies) {
  std::string name = clean(avatar.name_text());
  if (name.empty()) name = "avatar";
  while (std::ranges::find(bodies, name, &Body::name) != bodies.end()) {
    name += "-" + std::to_string(avatar.number);
  }
  return name;
}

std::string remark_about(const AvatarEntry& entry) {
  const bool is_studio = figure_of(entry) == Figure::kStudio;
  std::string figure = is_studio ? "the figure of Axis Studio" : "the figure of Axis Neuron";
  if (entry.figure) return figure;
  return figure + (entry.measured ? ", by the length of its bones"
                                  : ", because the stream has no displacement; is it Axis Studio? "
                                    "then give figure = \"studio\"");
}

}  // namespace

RT_SAFE Present* Roster::find(const Avatar& avatar) noexcept {
  Present* free = nullptr;
  for (Present& present : all_) {
    if (present.used && present.entry.avatar == avatar) return &present;
    if (!present.used && free == nullptr) free = &present;
  }
  if (free == nullptr) return nullptr;
  *free = {};
  free->entry.avatar = avatar;
  free->entry.figure = figure_;
  free->first_tick = newest_tick_;
  free->used = changed_ = true;
  return free;
}

RT_SAFE void Roster::see(Present& present, const Message& message, std::int64_t now_ns) noexcept {
  // After a pause of the whole stream, each avatar gets its time to come back.
  if (since(now_ns, received_ns_) > kGone_ns) {
    for (Present& other : all_) other.seen_ns = now_ns;
  }
  received_ns_ = present.seen_ns = now_ns;
  if (message.frame_number != 0) count_frames(present, message.frame_number);
  if (present.entry.reference != message.content.reference) {
    present.entry.reference = message.content.reference;
    changed_ = true;
  }
  if (message.content.displacement) measure(present, message, now_ns);
}

RT_SAFE void Roster::count_frames(Present& present, std::uint32_t frame_number) noexcept {
  present.tick = present.first_tick + present.counter.to(frame_number).ticks;
  newest_tick_ = std::max(newest_tick_, present.tick);
}

RT_SAFE void Roster::measure(Present& present, const Message& message,
                             std::int64_t now_ns) noexcept {
  const Proportions offset_cm = offsets_of(message);
  if (present.entry.measured) {
    if (!other_lengths(offset_cm, present.entry.offset_cm)) {
      present.differs_ns = kNoTime_ns;
      return;
    }
    if (present.differs_ns == kNoTime_ns) present.differs_ns = now_ns;
    if (since(now_ns, present.differs_ns) < kSettled_ns) return;
  }
  present.entry.offset_cm = offset_cm;
  present.entry.measured = true;
  present.differs_ns = kNoTime_ns;
  changed_ = true;
}

RT_SAFE void Roster::forget_gone(std::int64_t now_ns) noexcept {
  for (Present& present : all_) {
    if (!present.used || since(now_ns, present.seen_ns) <= kGone_ns) continue;
    present.used = false;
    changed_ = true;
  }
}

RT_SAFE std::span<const std::byte> Roster::news(std::int64_t now_ns) noexcept {
  forget_gone(now_ns);
  if (!changed_ || (described_ && since(now_ns, described_ns_) < kDescribeEvery_ns)) return {};
  const std::span<std::byte> list(list_);
  std::size_t size = write_list_head(
      order_, static_cast<std::size_t>(std::ranges::count(all_, true, &Present::used)), list);
  for (const Present& present : all_) {
    if (present.used) size += write_entry(present.entry, list.subspan(size));
  }
  changed_ = false;
  described_ = true;
  described_ns_ = now_ns;
  return list.first(size);
}

RT_SAFE void MessageReader::feed(std::span<const std::byte> bytes, Messages& messages) noexcept {
  while (!bytes.empty()) {
    if (end_ == buffer_.size()) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
      end_ -= begin_;
      begin_ = 0;
    }
    const std::size_t count = std::min(bytes.size(), buffer_.size() - end_);
    std::memcpy(buffer_.data() + end_, bytes.data(), count);
    end_ += count;
    bytes = bytes.subspan(count);
    while (begin_ != end_ && advance(messages)) {
    }
  }
}

RT_SAFE void MessageReader::drop(std::size_t count) noexcept {
  begin_ += count;
  scanned_ = 0;
  if (begin_ == end_) begin_ = end_ = 0;
}

RT_SAFE void MessageReader::count_damage(Outcome outcome, Messages& messages) noexcept {
  if (!in_damage_) messages.damage(outcome);
  in_damage_ = true;
}

RT_SAFE bool MessageReader::advance(Messages& messages) noexcept {
  const auto bytes = pending();
  if (scanned_ != 0 || overlong_) return advance_text(messages);
  if (is_blank(bytes[0])) {
    drop(1);
    return true;
  }
  if (bytes[0] != kMark) {
    if (is_text(bytes[0])) return advance_text(messages);
    count_damage(Outcome::kForeign, messages);
    drop(1);
    return true;
  }
  if (bytes.size() < 2) return false;
  if (bytes[1] == kMotion) return advance_binary(messages);
  if (bytes[1] == kCalculation) return advance_calculation(messages);
  count_damage(Outcome::kForeign, messages);
  drop(1);
  return true;
}

RT_SAFE bool MessageReader::advance_binary(Messages& messages) noexcept {
  const auto bytes = pending();
  if (bytes.size() < kHeaderBytes) return false;
  std::size_t size = 0;
  const Outcome outcome = measure_binary(bytes.first(kHeaderBytes), size);
  if (outcome != Outcome::kOk) {
    count_damage(outcome, messages);
    drop(2);
    return true;
  }
  if (bytes.size() < size) return false;
  // The next message begins inside this one if a datagram was lost or a connection was cut.
  const auto rest = bytes.subspan(kHeaderBytes, size - kHeaderBytes);
  const auto cut = std::ranges::search(rest, bytes.first(kCountAt));
  if (!cut.empty()) {
    count_damage(Outcome::kShort, messages);
    drop(kHeaderBytes + static_cast<std::size_t>(cut.begin() - rest.begin()));
    return true;
  }
  in_damage_ = !messages.binary(bytes.first(size), in_damage_) && in_damage_;
  drop(size);
  return true;
}

// The header of calculation data is counted; its values are then skipped as damage is.
RT_SAFE bool MessageReader::advance_calculation(Messages& messages) noexcept {
  const auto bytes = pending();
  if (bytes.size() < kHeaderBytes) return false;
  const auto end = bytes.subspan(kHeaderBytes - 2, 2);
  const bool header = end[0] == kMark && end[1] == kCalculationEnd;
  if (header) in_damage_ = false;  // each of them is counted
  count_damage(Outcome::kForeign, messages);
  drop(header ? kHeaderBytes : 2);
  return true;
}

RT_SAFE bool MessageReader::advance_text(Messages& messages) noexcept {
  const auto bytes = pending();
  constexpr std::byte kBar{'|'};
  std::size_t at = scanned_;
  while (at < bytes.size() && is_text(bytes[at])) {
    if (bytes[at] == kBar) {
      if (at + 1 == bytes.size()) break;
      if (bytes[at + 1] == kBar) {
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), at);
        if (!overlong_) messages.text(text, in_damage_);
        in_damage_ = overlong_ = false;
        drop(at + kTextEnd.size());
        return true;
      }
    }
    ++at;
  }
  if (at < bytes.size() && bytes[at] != kBar) {  // not text any more
    count_damage(Outcome::kShort, messages);
    overlong_ = false;
    drop(at);
    return true;
  }
  scanned_ = at;
  if (bytes.size() < buffer_.size()) return false;
  count_damage(Outcome::kShort, messages);
  overlong_ = true;
  drop(std::max<std::size_t>(at, 1));
  return true;
}

Result<std::shared_ptr<const Skeleton>> skeleton_of(const AvatarEntry& entry, std::uint8_t order) {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = clean(entry.avatar.name_text());
  const int above = entry.reference ? 1 : 0;  // joints above the hips
  if (entry.reference) {
    skeleton->joints.emplace_back().name = "Reference";
    add_channels(*skeleton, true, order);
  }
  skeleton->root_joint = above;
  const Figure figure = figure_of(entry);
  for (std::size_t b = 0; b < kBones; ++b) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = bone_name(b, figure);
    joint.parent = b == kHips ? above - 1 : bone_parent(b, figure) + above;
    joint.offset_m = metres(entry.offset_cm[b]);
    if (const Vec3f end_cm = bone_end_cm(b); end_cm != Vec3f{}) joint.end_site_m = metres(end_cm);
    add_channels(*skeleton, b == kHips, order);
  }
  TRY(skeleton->finish());
  return skeleton;
}

RT_SAFE std::size_t AxisLayout::body_of(const Avatar& avatar) const noexcept {
  return std::ranges::find(known, avatar, &Known::avatar) - known.begin();
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto list = TRY(parse_list(description));
  auto layout = std::make_unique<AxisLayout>();
  for (const AvatarEntry& entry : list.avatars) {
    auto skeleton = TRY(skeleton_of(entry, list.order));
    layout->bodies.push_back({.name = body_name(entry.avatar, layout->bodies),
                              .skeleton = std::move(skeleton),
                              .remark = remark_about(entry)});
    layout->known.push_back({.avatar = entry.avatar, .reference = entry.reference});
  }
  return layout;
}

namespace {

constexpr std::size_t kMaxFrameChannels = 6 + 3 + 3 * kBones;
constexpr double kMaxTime_s = 1e9;  // only damaged frame numbers lead so far

// The values of a message as those of skeleton_of()'s channels [m, rad]; returns their number.
RT_SAFE std::size_t to_channels(const Message& message,
                                std::array<double, kMaxFrameChannels>& channels) noexcept {
  std::size_t size = 0;
  const auto convert = [&](std::size_t at, double scale) {
    for (std::size_t i = 0; i < 3; ++i) channels[size++] = message.values[at + i] * scale;
  };
  if (message.content.reference) {
    convert(0, kCentimetre_m);
    convert(3, kDegree);
  }
  convert(rotations_at(message.content, kHips) - 3, kCentimetre_m);
  for (std::size_t b = 0; b < kBones; ++b) convert(rotations_at(message.content, b), kDegree);
  return size;
}

}  // namespace

RT_SAFE void AxisDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                               Sink& sink) noexcept {
  sink_ = &sink;
  now_ns_ = arrival_ns;
  reader_.feed(bytes, *this);
  if (const auto news = roster_.news(arrival_ns); !news.empty()) sink.description(news);
}

RT_SAFE bool AxisDecoder::binary(std::span<const std::byte> bytes, bool in_damage) noexcept {
  Outcome outcome = decode_binary(bytes, message_);
  const bool valid = outcome == Outcome::kOk;
  if (valid) outcome = accept_message();
  if (valid || !in_damage) sink_->outcome(outcome);
  return valid;
}

RT_SAFE void AxisDecoder::text(std::string_view text, bool in_damage) noexcept {
  Outcome outcome = decode_text(text, message_);
  const bool valid = outcome == Outcome::kOk;
  if (valid) outcome = accept_message();
  if (valid || !in_damage) sink_->outcome(outcome);
}

RT_SAFE Outcome AxisDecoder::accept_message() noexcept {
  Present* const present = roster_.find(message_.avatar);
  if (present == nullptr) return Outcome::kOutOfRange;  // more avatars than bodies of a source
  if (settings_.datagrams && message_.frame_number != 0) {
    const Outcome order = present->order.accept(message_.frame_number);
    if (order != Outcome::kOk) return order;
  }
  roster_.see(*present, message_, now_ns_);
  if (layout_ == nullptr) return Outcome::kForeign;
  const std::size_t body = layout_->body_of(message_.avatar);
  if (body == layout_->bodies.size() ||
      layout_->known[body].reference != message_.content.reference) {
    return Outcome::kForeign;  // until the new description is in use
  }
  emit_frame(body, *present);
  return Outcome::kOk;
}

RT_SAFE void AxisDecoder::emit_frame(std::size_t body, const Present& present) noexcept {
  std::array<double, kMaxFrameChannels> channels;
  const std::size_t count = to_channels(message_, channels);
  Frame frame;
  if (settings_.rate_hz > 0.0 && message_.frame_number != 0) {
    const double time_s = static_cast<double>(present.tick) / settings_.rate_hz;
    if (time_s < kMaxTime_s) frame.header.device_ns = nanoseconds(time_s);
  }
  pose_from_channels(*layout_->bodies[body].skeleton, std::span(channels).first(count), frame);
  sink_->frame(body, frame);
}

}  // namespace posed::drivers::axis
