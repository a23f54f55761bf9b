// HandMap: how the frames of one glove become hand poses, and how a hand pose turns the joints of
// the merged skeleton (models/merge/README.md, "Hand poses"). Const after bind(); hot calls are
// RT-safe.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/frame/time.hpp"

namespace posed::merge {

inline constexpr std::size_t kWrist = kHandJoints;  // its place, behind the finger joints
inline constexpr std::size_t kHandTurns = kHandJoints + 1;

// The fifteen finger joints and the wrist of one hand as canonical rotations
// (models/motion/README.md, "Canonical humanoid"), so that a glove's pose fits any body's skeleton.
struct HandPose {
  // [finger joint, then wrist] relative to the bone above; identity in T-pose.
  std::array<Eigen::Quaterniond, kHandTurns> turn;
  std::bitset<kHandTurns> valid;  // known; the others have no meaning

  HandPose() noexcept { turn.fill(Eigen::Quaterniond::Identity()); }
};

// A pose that a glove measured.
struct TimedPose {
  std::int64_t time_ns = kNoTime_ns;  // on the host's clock
  Quality quality = Quality::kMeasured;
  HandPose pose;
};

// `base`, with each joint that both `a` and `b` know on the shortest arc from `a` (part 0) to `b`
// (part 1).
RT_SAFE [[nodiscard]] inline HandPose blend(const HandPose& base, const HandPose& a,
                                            const HandPose& b, double part) noexcept {
  HandPose pose = base;
  for (std::size_t i = 0; i < kHandTurns; ++i) {
    if (a.valid[i] && b.valid[i]) pose.turn[i] = a.turn[i].slerp(part, b.turn[i]);
  }
  return pose;
}

// Which source turns the wrist of the merged skeleton.
enum class Wrist : std::uint8_t {
  kAuto,  // the glove's if it measures it, that is, has channels on it
  kBody,
  kGlove
};

class HandMap {
 public:
  // `stream`, of the glove, is for the errors. Both skeletons outlive the object.
  static Result<HandMap> bind(const std::string& stream, Side side, const Skeleton& glove,
                              const Skeleton& merged, Wrist wrist);
  // Whether bind() could use the glove for this side; the error says why not. Cold.
  static Result<> check(const std::string& stream, Side side, const Skeleton& glove);

  // What a frame of the glove says.
  [[nodiscard]] HandPose read(const Frame& glove) const noexcept;
  // Turns the joints that the pose knows, in a frame of the merged skeleton; the others stay.
  void write(const HandPose& pose, Frame& frame) const noexcept;

  // A hand at rest: its fingers are a little bent, its wrist is straight. Cold.
  [[nodiscard]] HandPose relaxed() const;

 private:
  // Canonical = before * (rotation relative to `above`) * after.
  struct Reading {
    int joint = -1, above = -1;  // of the glove; above -1: the rotation itself
    Eigen::Quaterniond before, after;
  };
  // Local rotation = before * canonical * after.
  struct Turning {
    int joint = -1;  // of the merged skeleton; -1: the body's own wrist stays
    Eigen::Quaterniond before, after;
  };

  HandMap() = default;
  [[nodiscard]] static Reading reading_of(Side side, int finger, const Skeleton& glove);
  Result<> bind_finger(Side side, int finger, const Skeleton& glove);
  void bind_wrist(Side side, const Skeleton& glove);

  const Skeleton* glove_ = nullptr;
  const Skeleton* merged_ = nullptr;
  Side side_ = Side::kRight;
  std::array<Reading, kHandTurns> read_;
  std::array<Turning, kHandTurns> turn_;
  // Joints between hand and fingers that are no bones, and their rotations: as in the T-pose.
  std::vector<std::pair<int, Eigen::Quaterniond>> stiff_;
};

}  // namespace posed::merge
