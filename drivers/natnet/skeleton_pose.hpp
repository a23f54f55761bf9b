// SkeletonPose: the bones of one skeleton as a frame of NatNet lists them, and the Frame that they
// make.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>

#include "drivers/natnet/decoder.hpp"
#include "drivers/natnet/frame.hpp"
#include "drivers/natnet/layout.hpp"
#include "proto/frame/frame.hpp"

namespace posed::drivers::natnet {

// All calls are RT-safe.
class SkeletonPose {
 public:
  // `table` outlives the pose.
  explicit SkeletonPose(const BodyTable& table) noexcept : table_(table) {}

  // Adds a bone, whose values are in posed's axes; the bones of a packet mostly come in the order
  // of the table. False when the bone is unknown, came before or has values that make no sense.
  [[nodiscard]] bool add(const RigidBody& bone) noexcept;

  // Whether the description has the bones so far, and as many as these.
  [[nodiscard]] bool is_described(std::size_t bones) const noexcept {
    return !undescribed_ && bones == table_.bone_ids.size();
  }

  // Fills root position, rotations and validity. False when a bone is missing.
  [[nodiscard]] bool fill(Coordinates coordinates, Frame& frame) const noexcept;

 private:
  // Returns whether the positions are relative to the parents: then they are the offsets of the
  // description, however the person moves.
  [[nodiscard]] bool looks_local() const noexcept;

  const BodyTable& table_;
  std::size_t next_ = 0;
  bool undescribed_ = false;
  std::bitset<kMaxJoints> seen_, tracked_;
  std::array<Vec3f, kMaxJoints> position_m_{};
  std::array<Quatf, kMaxJoints> rotation_xyzw_{};
};

}  // namespace posed::drivers::natnet
