#include "drivers/chain/decoder.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/chain/protocol.hpp"
#include "drivers/pose_values.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/label.hpp"
#include "proto/frame/plausible.hpp"
#include "proto/message/skeleton_message.hpp"

namespace posed::drivers::chain {

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  v1::Skeleton message;
  if (!message.ParseFromArray(description.data(), static_cast<int>(description.size()))) {
    return fail("the upstream's skeleton is damaged; is it a posed of another version?");
  }
  if (!is_upstream_stream(message.stream())) {
    return fail("the upstream's skeleton names no stream; is it a posed of another version?");
  }
  auto skeleton = TRY(message::skeleton_from(message));
  auto layout = std::make_unique<UpstreamLayout>();
  layout->upstream_id = message.id();
  const double rate_hz = message.rate_hz();
  layout->bodies.push_back({.name = message.stream(),
                            .skeleton = std::move(skeleton),
                            .rate_hz = rate_hz > 0.0 && rate_hz <= 1000.0 ? rate_hz : 0.0});
  return layout;
}

namespace {

constexpr std::uint64_t kMaxLag_frames = 1000;
constexpr float kMaxLag_ms = 60'000.0F;

// Puts rotations and validity of all joints in their places; false when they are none of this
// skeleton.
RT_SAFE bool read_joints(const UpstreamFrame& upstream, std::size_t joints, Frame& frame) noexcept {
  if (upstream.rotation_xyzw.count != 4 * joints || upstream.validity.size() != joints) {
    return false;
  }
  for (std::size_t j = 0; j < joints; ++j) {
    Quatf& rotation = frame.rotation_xyzw[j];
    std::copy_n(&upstream.rotation_xyzw.values[4 * j], 4, rotation.begin());
    bool seen = false;
    if (!accept_rotation(rotation, seen)) return false;
    frame.valid[j] = seen && upstream.validity[j] != std::byte{0};
  }
  frame.joint_count = static_cast<std::uint16_t>(joints);
  return true;
}

// The angles of the rotation channels, if the upstream sends them. Of a joint that was not measured
// an angle may be NaN.
RT_SAFE bool read_angles(const UpstreamFrame& upstream, const Skeleton& skeleton,
                         Frame& frame) noexcept {
  const std::size_t count = upstream.angle_rad.count;
  if (count == 0) return true;
  std::size_t used = 0;
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    if (used == count) return false;
    const float angle_rad = upstream.angle_rad.values[used];
    const bool finite = std::isfinite(angle_rad);
    if (finite ? std::abs(angle_rad) > kMaxAngle_rad : frame.valid[channel.joint]) return false;
    frame.angle_rad[used++] = angle_rad;
  }
  frame.angle_count = static_cast<std::uint16_t>(used);
  return used == count;
}

// Reads what the upstream says about the pose beside the joints.
RT_SAFE bool read_words(const UpstreamFrame& upstream, Frame& frame) noexcept {
  const float probability = upstream.label_probability;
  const bool valid = upstream.quality <= static_cast<std::uint64_t>(Quality::kStale) &&
                     upstream.source <= static_cast<std::uint64_t>(Source::kLabels) &&
                     (upstream.label.empty() || is_label_name(upstream.label)) &&
                     probability >= 0.0F && probability <= 1.0F &&
                     upstream.lag_frames <= kMaxLag_frames && upstream.lag_ms >= 0.0F &&
                     upstream.lag_ms <= kMaxLag_ms;  // false for NaN
  if (!valid) return false;
  frame.quality = static_cast<Quality>(upstream.quality);
  frame.source = static_cast<Source>(upstream.source);
  std::ranges::copy(upstream.label, frame.label.begin());
  frame.timecode = to_timecode(upstream.timecode);
  frame.label_probability = probability;
  frame.lag_frames = static_cast<std::uint16_t>(upstream.lag_frames);
  frame.lag_ms = upstream.lag_ms;
  return true;
}

}  // namespace

RT_SAFE void UpstreamDecoder::feed(std::span<const std::byte> bytes, std::int64_t /*arrival_ns*/,
                                   Sink& sink) noexcept {
  sink.outcome(accept(bytes, sink));
}

RT_SAFE Outcome UpstreamDecoder::accept(std::span<const std::byte> bytes, Sink& sink) noexcept {
  UpstreamMessage message;
  if (!split_message(bytes, message)) return Outcome::kShort;
  if (message.topic == pose_topic_) return accept_pose(message.body, sink);
  if (message.topic != skeleton_topic_) return Outcome::kForeign;
  if (message.body.empty()) return Outcome::kShort;
  if (is_of_other_stream(message.body, stream_)) return Outcome::kForeign;
  sink.description(message.body);
  return Outcome::kOk;
}

RT_SAFE Outcome UpstreamDecoder::accept_pose(std::span<const std::byte> body, Sink& sink) noexcept {
  upstream_ = {};
  if (const Outcome read = read_frame(body, upstream_); read != Outcome::kOk) return read;
  // Until its skeleton comes, a pose says nothing.
  if (layout_ == nullptr || upstream_.skeleton_id != layout_->upstream_id) return Outcome::kForeign;
  const Skeleton& skeleton = *layout_->bodies[0].skeleton;
  Frame frame;
  frame.skeleton = skeleton.id;
  const bool valid = read_joints(upstream_, skeleton.joints.size(), frame) &&
                     read_angles(upstream_, skeleton, frame) && read_words(upstream_, frame) &&
                     upstream_.root_position_m.count == 3 &&
                     is_plausible(upstream_.root_position_m.values);
  if (!valid) return Outcome::kOutOfRange;
  // While its own source is silent the upstream repeats the last pose once a second. That is no
  // sign of life, also for who has only just connected: the stream becomes or stays stale here,
  // too.
  if (frame.quality == Quality::kStale) return Outcome::kDuplicate;
  if (const Outcome order = order_.accept(upstream_.sequence); order != Outcome::kOk) return order;
  // The sequence says what is new; a clock that was set back only stops the time.
  static_cast<void>(clock_.accept(seconds(upstream_.arrival_ns)));
  frame.header.device_ns = clock_.device_ns();
  frame.root_position_m = upstream_.root_position_m.values;
  sink.frame(0, frame);
  return Outcome::kOk;
}

}  // namespace posed::drivers::chain
