// Frame: one pose of one stream at one instant. Sample: the named values of one device at one
// instant. Both are trivially copyable, have a fixed capacity and hold no pointer, so that they can
// cross a lock-free ring by value. Coordinates: right-handed, Y up, metres, radians; a person in
// T-pose faces +Z with the left hand at +X. A rotation maps a joint's frame to its parent's frame.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <type_traits>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/time.hpp"
#include "proto/frame/timecode.hpp"

namespace posed {

inline constexpr int kMaxJoints = 96;
inline constexpr int kMaxChannels = 288;  // three per joint
inline constexpr int kMaxSampleValues = 512;
inline constexpr int kMaxRobotJoints = 64;
inline constexpr int kMaxLabel = 16;  // bytes, including the closing zero

using Vec3f = std::array<float, 3>;
using Quatf = std::array<float, 4>;  // x, y, z, w; unit length
inline constexpr Quatf kIdentity{0.0F, 0.0F, 0.0F, 1.0F};

enum class Quality : std::uint8_t { kMeasured, kPredicted, kHeld, kStale };
enum class Source : std::uint8_t { kDevice, kFile, kReplay, kLabels };

// What a robot may do with the frame, whose channels are its joints.
enum class RobotState : std::uint8_t {
  kNone,      // the stream is no robot's
  kReleased,  // nobody has engaged it: the frame is not a command
  kEngaged,   // it follows the hand
  kHolding,   // engaged, but the hand cannot be trusted: it brakes, then stands
};

// Host time [ns] at which each step finished with the frame; kNoTime_ns before that.
struct StageStamps {
  std::int64_t decoded_ns = kNoTime_ns;
  std::int64_t published_ns = kNoTime_ns;  // handed to the publisher
};

// Origin and times, common to frames and samples.
struct Header {
  std::uint32_t stream = 0;              // index of the stream in the daemon's config
  std::uint64_t sequence = 0;            // counts the stream's frames from 1; see Quality::kStale
  std::int64_t device_ns = kNoTime_ns;   // the device's own time; kNoTime_ns if it has none
  std::int64_t arrival_ns = kNoTime_ns;  // host time, taken right after the read
  ClockMapping clock;                    // mapping from device time to host time, as far as known
};

struct Frame {
  Header header;
  std::uint32_t skeleton = 0;  // Skeleton::id of the source's own skeleton
  std::uint16_t joint_count = 0;
  std::uint16_t angle_count = 0;  // rotation channels of the skeleton; 0 when it lists none
  Quality quality = Quality::kMeasured;
  Source source = Source::kDevice;
  std::uint16_t lag_frames = 0;
  float lag_ms = 0.0F;
  std::array<char, kMaxLabel> label{};  // recognised or played gesture; empty when none
  float label_probability = 0.0F;
  Timecode timecode{};      // empty when the source has none
  Vec3f root_position_m{};  // the skeleton's root_joint in the world
  StageStamps stamps;
  std::array<float, 8> stage_us{};  // spent in each stage of the stream, in their order
  // The joint was measured; otherwise its rotation is identity, or that of the T-pose after
  // retargeting.
  std::bitset<kMaxJoints> valid;
  std::array<Quatf, kMaxJoints> rotation_xyzw{};  // [joint], parent-relative
  std::array<float, kMaxChannels> angle_rad{};    // [rotation channel], in Skeleton::channels order
  RobotState robot = RobotState::kNone;
  std::array<float, kMaxRobotJoints> velocity_rad_s{};  // [rotation channel] of a robot's stream
};
static_assert(std::is_trivially_copyable_v<Frame>);

// Gives `out` everything of `in` that does not depend on a skeleton: times, quality, source, lag,
// label, timecode.
RT_SAFE inline void copy_all_but_pose(const Frame& in, Frame& out) noexcept {
  out.header = in.header;
  out.quality = in.quality;
  out.source = in.source;
  out.lag_frames = in.lag_frames;
  out.lag_ms = in.lag_ms;
  out.label = in.label;
  out.label_probability = in.label_probability;
  out.timecode = in.timecode;
  out.stamps = in.stamps;
  out.stage_us = in.stage_us;
}

struct Sample {
  Header header;
  std::uint16_t value_count = 0;
  Quality quality = Quality::kMeasured;
  std::bitset<kMaxSampleValues> valid;
  std::array<float, kMaxSampleValues> value{};  // in the units of the device's SampleLayout
};
static_assert(std::is_trivially_copyable_v<Sample>);

}  // namespace posed
