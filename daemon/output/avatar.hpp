// Avatar: one pose of the VMC protocol's humanoid, put together from a stream with the body and
// streams with single hands. Each stream is brought onto the canonical humanoid with its own
// proportions; the fingers of a hand's stream replace those of the body.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
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
  // `hands_only`: of the body only wrists and fingers are written, as an assistant does.
  explicit Avatar(bool hands_only) : hands_only_(hands_only) {}

  // The stream of a part has come, or has left (null). Without an error the part has no pose until
  // the next pose(); an error says why the skeleton cannot move this part, and then it gets none.
  // Cold.
  [[nodiscard]] Result<> set_skeleton(Part part, std::shared_ptr<const Skeleton> skeleton);

  // A frame of the part's skeleton. Returns false, and does nothing, for a part without one.
  bool pose(Part part, const Frame& frame) noexcept;

  // Writes the root, if there is a whole body, and all bones that have a pose, parents first. Other
  // positions than that of the hips are those of the T-pose.
  void write(drivers::vmc::DatagramWriter& writer) const noexcept;

 private:
  struct Moved {
    std::size_t joint = 0;  // of the canonical skeleton
    std::size_t bone = 0;   // of the protocol
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
  std::array<Source, kParts> sources_;  // [part]
};

}  // namespace posed::output
