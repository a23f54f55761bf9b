// Avatar: one pose of the VMC protocol's humanoid, put together from a stream with the body and
// streams with single hands. Each stream is brought onto the canonical humanoid with its own
// proportions, or with an avatar's; the fingers of a hand's stream replace those of the body.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/output/part.hpp"
#include "drivers/vmc/messages.hpp"
#include "models/motion/retarget.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// One thread.
class Avatar {
 public:
  // With `hands_only` only the body's wrists and fingers are written, as VMC's role "assistant"
  // does.
  // `figure` has the proportions that are sent; null: each part's own.
  explicit Avatar(bool hands_only, std::shared_ptr<const Skeleton> figure = nullptr)
      : hands_only_(hands_only), figure_(std::move(figure)) {}

  // Sets the skeleton of a part whose stream has come; null when the stream has left. The part has
  // no pose until the next set_pose(). An error says why the skeleton cannot move this part. Cold.
  Result<> set_skeleton(Part part, std::shared_ptr<const Skeleton> skeleton);

  // Sets the pose of a part. Returns false, and does nothing, for a part without a skeleton.
  bool set_pose(Part part, const Frame& frame) noexcept;

  // Writes the root, if there is a whole body, and all bones that have a pose, parents first. All
  // positions but that of the hips are those of the T-pose.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Moved {
    std::size_t joint = 0;  // index in the canonical skeleton
    std::size_t bone = 0;   // index in the protocol
    Vec3f offset_m{};
  };
  struct Source {
    std::optional<motion::Retarget> to_canonical;
    std::vector<Moved> moved;
    Frame pose{};  // on the canonical skeleton
    bool posed = false;
  };
  [[nodiscard]] bool writes(Part part, Bone bone) const noexcept;

  bool hands_only_;
  std::shared_ptr<const Skeleton> figure_;
  std::array<Source, kParts> sources_;  // [part]
};

}  // namespace posed::output
