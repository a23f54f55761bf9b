#include "proto/message/frame_message.hpp"

#include <algorithm>

namespace posed::message {

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
  message_.set_robot_state(static_cast<v1::RobotState>(frame.robot));
  const std::size_t robot_joints = frame.robot == RobotState::kNone ? 0 : frame.angle_count;
  assign(*message_.mutable_velocity_rad_s(), {frame.velocity_rad_s.data(), robot_joints});
  message_.set_quality(static_cast<v1::Quality>(frame.quality));
  message_.set_source(static_cast<v1::Source>(frame.source));
  message_.mutable_label()->assign(frame.label.begin(), std::ranges::find(frame.label, '\0'));
  message_.mutable_timecode()->assign(view_of(frame.timecode));
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

}  // namespace posed::message
