#include "daemon/publish/encode.hpp"
#include "proto/text/clean.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace posed::publish {
namespace {

// Replaces the content of `field` with `values`, reusing its memory.
void assign(google::protobuf::RepeatedField<float>& field, std::span<const float> values) {
  field.Resize(static_cast<int>(values.size()), 0.0F);
  std::ranges::copy(values, field.begin());
}

template <std::size_t N>
void assign_flags(std::string& bytes, const std::bitset<N>& valid, std::size_t count) {
  bytes.resize(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = valid[i] ? 1 : 0;
}

}  // namespace

const v1::Frame& FrameEncoder::encode(const Frame& frame) {
  const Header& header = frame.header;
  message_.set_sequence(header.sequence);
  if (header.device_ns != kNoTime_ns) {
    message_.set_device_ns(header.device_ns);
  } else {
    message_.clear_device_ns();
  }
  message_.set_arrival_ns(header.arrival_ns);
  if (header.clock.valid) {
    message_.set_clock_offset_ns(header.clock.offset_ns);
  } else {
    message_.clear_clock_offset_ns();
  }
  message_.set_clock_drift_ppm(header.clock.drift_ppm);
  message_.set_skeleton_id(frame.skeleton);
  assign(*message_.mutable_root_position_m(), frame.root_position_m);
  const std::size_t joints = frame.joint_count;
  assign(*message_.mutable_rotation_xyzw(), {frame.rotation_xyzw.front().data(), joints * 4});
  assign_flags(*message_.mutable_validity(), frame.valid, joints);
  assign(*message_.mutable_angle_rad(), {frame.angle_rad.data(), frame.angle_count});
  message_.set_quality(static_cast<v1::Quality>(frame.quality));
  message_.set_source(static_cast<v1::Source>(frame.source));
  const auto label_end = std::ranges::find(frame.label, '\0');
  message_.mutable_label()->assign(frame.label.begin(), label_end);
  message_.set_label_probability(frame.label_probability);
  message_.set_lag_frames(frame.lag_frames);
  message_.set_lag_ms(frame.lag_ms);
  message_.clear_decoded_ns();
  message_.clear_published_ns();
  message_.clear_stage_us();
  return message_;
}

const v1::Frame& FrameEncoder::stamp(const StageStamps& stamps, std::span<const float> stage_us) {
  if (stamps.decoded_ns != kNoTime_ns) message_.set_decoded_ns(stamps.decoded_ns);
  if (stamps.published_ns != kNoTime_ns) message_.set_published_ns(stamps.published_ns);
  assign(*message_.mutable_stage_us(), stage_us);
  return message_;
}

SampleEncoder::SampleEncoder(const std::string& stream, const drivers::SampleLayout& layout) {
  message_.set_stream(stream);
  for (const std::string& name : layout.names) message_.add_name(name);
  for (const std::string& unit : layout.units) message_.add_unit(unit);
}

const v1::Sample& SampleEncoder::encode(const Sample& sample) {
  message_.set_sequence(sample.header.sequence);
  if (sample.header.device_ns != kNoTime_ns) {
    message_.set_device_ns(sample.header.device_ns);
  } else {
    message_.clear_device_ns();
  }
  message_.set_arrival_ns(sample.header.arrival_ns);
  assign(*message_.mutable_value(), {sample.value.data(), sample.value_count});
  assign_flags(*message_.mutable_validity(), sample.valid, sample.value_count);
  message_.set_quality(static_cast<v1::Quality>(sample.quality));
  return message_;
}

v1::Skeleton skeleton_message(const std::string& stream, const Skeleton& skeleton, double rate_hz) {
  const Eigen::Vector3d no_tip_m =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  v1::Skeleton message;
  message.set_stream(stream);
  message.set_id(skeleton.id);
  message.set_name(clean(skeleton.name));  // a file's name need not be UTF-8, a message's must
  message.set_root_joint(static_cast<std::uint32_t>(skeleton.root_joint));
  message.set_rate_hz(rate_hz);
  for (const Joint& joint : skeleton.joints) {
    message.add_joint_name(clean(joint.name));
    message.add_parent(joint.parent);
    for (const double value : joint.offset_m) message.add_offset_m(static_cast<float>(value));
    const Eigen::Vector3d tip_m = joint.end_site_m.value_or(no_tip_m);
    for (const double value : tip_m) message.add_end_site_m(static_cast<float>(value));
    message.add_humanoid_bone(joint.bone ? std::string(bone_name(*joint.bone)) : std::string());
    for (const float value : from_eigen(joint.T_world_joint)) message.add_t_world_joint_xyzw(value);
  }
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    message.add_channel_joint(channel.joint);
    message.mutable_channel_axis()->push_back("xyz"[static_cast<std::size_t>(channel.axis)]);
  }
  return message;
}

}  // namespace posed::publish
