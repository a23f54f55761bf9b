// Fit: brings a person's frames onto the figure that a protocol sends. A person whose skeleton is
// one of the protocol's goes out with its own bones; any other one moves an average figure with the
// length of the person's legs, so that its feet stand where the person's do.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/motion/retarget.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// One thread.
class Fit {
 public:
  // Makes the average figure, all lengths times `scale`.
  using MakeFigure = std::function<Result<std::shared_ptr<const Skeleton>>(double scale)>;

  // `own`: the skeleton goes out as it is, such as one of the protocol's or a prop. Fails for a
  // stream without a skeleton; unless `own`, also for one that has no bone of the figure. Cold.
  static Result<Fit> make(std::shared_ptr<const Skeleton> person, bool own,
                          const MakeFigure& figure);

  [[nodiscard]] const Skeleton& skeleton() const noexcept { return *skeleton_; }
  // Returns the frame on that skeleton, valid until the next call; a figure's has no channel
  // angles. A joint that was not measured keeps its rotation of the T-pose relative to its parent.
  [[nodiscard]] const Frame& apply(const Frame& frame) noexcept;

 private:
  Fit() = default;

  std::shared_ptr<const Skeleton> skeleton_;
  std::optional<motion::Retarget> retarget_;  // none: the person's own bones
  std::vector<Quatf> rest_xyzw_;              // [joint] of the own bones, in T-pose
  Frame pose_{};
};

// Sets names[place], under which the person at `place` is sent, and returns it: `own`, or the
// stream's name if another person of the output is named so, or that with a number behind it.
[[nodiscard]] std::string distinct_name(const std::string& own, const std::string& stream,
                                        std::size_t place, std::vector<std::string>& names);

// Whether the skeleton has fingers, by those of the index.
[[nodiscard]] bool has_fingers(const Skeleton& skeleton);

// Whether every T frame is identity, and the first joint is the root.
[[nodiscard]] bool rests_unturned(const Skeleton& skeleton) noexcept;

}  // namespace posed::output
