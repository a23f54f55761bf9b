// Pieces of the JSON that Rokoko Studio sends, for the emulator and for outputs, and an average
// person. Cold: allocates.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/rokoko/description.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

struct LZ4F_cctx_s;  // of lz4frame.h

namespace posed::drivers::rokoko {

// Appends "position":{...},"rotation":{...}, given in posed's axes.
void append_transform(std::string& json, const Vec3f& position_m, const Quatf& rotation_xyzw);
// Appends the joints of an actor, "hip":{...},"spine":{...}: the global pose from the frame's. A
// joint that is not valid is sent as all zero.
void append_joints(std::string& json, const Skeleton& skeleton, const Frame& frame);

// Makes LZ4 frames of the JSON, one after another in the same memory.
class Lz4Writer {
 public:
  Lz4Writer();
  // Empty where memory is short. The bytes live until the next call.
  [[nodiscard]] std::span<const std::byte> compress(std::string_view json);

 private:
  struct Free {
    void operator()(LZ4F_cctx_s* context) const noexcept;
  };
  std::unique_ptr<LZ4F_cctx_s, Free> context_;
  std::vector<std::byte> bytes_;
};

// A person of 1.75 m times `scale` in T-pose with these joints: what Studio would stream and the
// decoder would describe.
[[nodiscard]] DescribedBody average_person(std::string_view name, const JointSet& joints,
                                           float scale);
// All joints but those of the fingers.
[[nodiscard]] JointSet without_fingers();

}  // namespace posed::drivers::rokoko
