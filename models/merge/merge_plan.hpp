// MergePlan: everything about a merged stream that is fixed before its first frame. Built cold from
// the stage's context; then const.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/merge/hand_map.hpp"
#include "models/merge/merged_skeleton.hpp"
#include "models/parameter_table.hpp"
#include "models/stage_type.hpp"

namespace posed::merge {

// The parameters of the merge stage.
struct MergeOptions {
  std::array<std::string, 2> gloves{};  // names of their streams: left, right; empty: none
  double wait_s = 0.015;
  std::string wrist = "auto";
  double hold_s = 1.0;

  [[nodiscard]] static const ParameterTable<MergeOptions, Stage>& table();
};

struct MergePlan {
  struct Hand {
    std::shared_ptr<const Skeleton> glove;
    double rate_hz = 0.0;  // of the glove; 0: unknown
    HandMap map;
  };

  // Where the angles of a joint of the hands are in Frame::angle_rad.
  struct JointAngles {
    std::size_t joint = 0, first = 0, count = 0;
  };

  std::shared_ptr<const Skeleton> body;
  MergedSkeleton merged;
  std::uint16_t angles = 0;                    // rotation channels of the merged skeleton
  std::array<std::optional<Hand>, 2> hands{};  // left, right
  std::vector<JointAngles> hand_angles{};
  std::int64_t wait_ns = 0;
  std::int64_t hold_ns = 0;

  // The error names the stream of a glove that does not fit.
  static Result<MergePlan> make(const StageContext& context);
  // The body's frame on the merged skeleton. Joints that the body does not have are not valid, and
  // have the angles that `out` had: the next ones are chosen near to them.
  RT_SAFE void expand(const Frame& in, Frame& out) const noexcept;
  // Call when the hands are written: joints that are not valid have no angles.
  RT_SAFE void remove_unknown_angles(Frame& frame) const noexcept;
};

// The value of the parameter `wrist`; empty for an unknown word.
[[nodiscard]] std::optional<Wrist> wrist_from_name(std::string_view name);

}  // namespace posed::merge
