// Avatar: one pose of the VMC protocol's humanoid, put together from a stream with the body and
// streams with single hands. Each stream is brought onto the canonical humanoid with its own
// proportions, or with an avatar's; the fingers of a hand's stream replace those of the body.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/vmc/messages.hpp"
#include "models/motion/retarget.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// The parts of an avatar that have streams of their own.
enum class Part : std::uint8_t { kBody, kLeftHand, kRightHand };
inline constexpr std::size_t kParts = 3;
inline constexpr std::array<Part, kParts> kAllParts{Part::kBody, Part::kLeftHand, Part::kRightHand};

[[nodiscard]] constexpr std::size_t index_of(Part part) noexcept {
  return static_cast<std::size_t>(part);
}

// The name of the part in the config.
[[nodiscard]] constexpr std::string_view words_for(Part part) noexcept {
  constexpr std::array<std::string_view, kParts> kWords{"body", "left hand", "right hand"};
  return kWords[index_of(part)];
}

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
