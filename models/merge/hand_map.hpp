// HandMap: how the frames of one glove become hand poses, and how a hand pose turns the joints of
// the merged skeleton (README.md, "Hand poses"). Const after bind(); hot calls are RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "models/merge/hand_pose.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::merge {

// Whose wrist the merged skeleton gets.
enum class Wrist : std::uint8_t {
  kAuto,  // the glove's if it measures it, that is, has channels on it
  kBody,
  kGlove
};

class HandMap {
 public:
  // `stream`, of the glove, is for the errors. Both skeletons outlive the object.
  [[nodiscard]] static Result<HandMap> bind(const std::string& stream, Side side,
                                            const Skeleton& glove, const Skeleton& merged,
                                            Wrist wrist);
  // Whether bind() could use the glove for this side; the error says why not. Cold.
  [[nodiscard]] static Result<> check(const std::string& stream, Side side, const Skeleton& glove);

  // What a frame of the glove says.
  [[nodiscard]] HandPose read(const Frame& glove) const noexcept;
  // Turns the joints that the pose knows, in a frame of the merged skeleton; the others stay.
  void write(const HandPose& pose, Frame& frame) const noexcept;

  // A hand at rest: its fingers are a little bent, its wrist is straight. Cold.
  [[nodiscard]] HandPose relaxed() const;
  [[nodiscard]] bool has_wrist() const noexcept { return turn_[kWrist].joint >= 0; }

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
  [[nodiscard]] Result<> bind_finger(Side side, int finger, const Skeleton& glove);
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
