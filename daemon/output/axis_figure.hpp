// AxisFigure: poses of any person in the forms in which Axis Neuron sends them (binary, or text:
// the line of a BVH; drivers/axis/protocol.hpp), and the BVH header that describes the figure.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "drivers/axis/bones.hpp"
#include "drivers/axis/pose_message.hpp"
#include "drivers/axis/protocol.hpp"
#include "models/motion/retarget.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// One thread.
class AxisFigure {
 public:
  // Makes a figure that has the legs of `skeleton`, so that its feet stand where the person's do,
  // and otherwise the proportions of an average person. Fails if the skeleton has no bone of a
  // person. Cold.
  static Result<AxisFigure> make(std::shared_ptr<const Skeleton> skeleton, std::string_view name);

  // Returns a frame of the skeleton as "0 ann 0.000000 92.1... ||\n", valid until the next call. A
  // joint that was not measured keeps its rotation of the T-pose relative to its parent.
  [[nodiscard]] std::string_view line(const Frame& frame) noexcept;

  // Returns it as the bytes of a binary message, in the same way.
  [[nodiscard]] std::string_view message(const Frame& frame) noexcept;

  // Returns the HIERARCHY of a BVH whose channels are the values of a line.
  [[nodiscard]] std::string hierarchy() const;

 private:
  void fill(const Frame& frame) noexcept;
  AxisFigure(motion::Retarget retarget, const drivers::axis::Proportions& offset_cm)
      : to_figure_(std::move(retarget)), offset_cm_(offset_cm) {}

  motion::Retarget to_figure_;
  drivers::axis::Proportions offset_cm_;
  drivers::axis::NearAngles near_rad_{};
  drivers::axis::Message message_;
  Frame pose_{};
  std::array<char, drivers::axis::kMaxText + 1> text_{};
};

}  // namespace posed::output
