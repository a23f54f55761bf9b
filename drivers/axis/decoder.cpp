#include "drivers/axis/decoder.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::axis {

namespace {

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
  const std::string figure = is_studio ? "the figure of Axis Studio" : "the figure of Axis Neuron";
  if (entry.figure) return figure;
  return figure + (entry.measured ? ", by the length of its bones"
                                  : ", because the stream has no displacement; is it Axis Studio? "
                                    "then give figure = \"studio\"");
}

}  // namespace

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
