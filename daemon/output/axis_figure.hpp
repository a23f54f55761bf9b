// AxisFigure: poses of any person in the forms in which Axis Neuron sends them (binary, or text:
// the line of a BVH; drivers/axis/protocol.hpp), and the BVH header that describes the figure.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/output/fit.hpp"
#include "drivers/axis/bones.hpp"
#include "drivers/axis/pose_message.hpp"
#include "drivers/axis/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::output {

// One thread.
class AxisFigure {
 public:
  // Makes the figure of a person (Fit::make) whose avatar has this number and name. Cold.
  static Result<AxisFigure> make(std::shared_ptr<const Skeleton> skeleton, std::uint8_t number,
                                 std::string_view name);

  // Returns a frame of the skeleton as "0 ann 0.000000 92.1... ||\n", valid until the next call. A
  // joint that was not measured keeps its rotation of the T-pose relative to its parent.
  [[nodiscard]] std::string_view line(const Frame& frame) noexcept;

  // Returns it as the bytes of a binary message, in the same way.
  [[nodiscard]] std::string_view message(const Frame& frame) noexcept;

  // Returns the HIERARCHY of a BVH whose channels are the values of a line.
  [[nodiscard]] std::string hierarchy() const;

 private:
  void fill(const Frame& frame) noexcept;
  AxisFigure(Fit fit, const drivers::axis::Proportions& offset_cm)
      : fit_(std::move(fit)), offset_cm_(offset_cm) {}

  Fit fit_;
  drivers::axis::Proportions offset_cm_;
  drivers::axis::NearAngles near_rad_{};
  drivers::axis::Message message_;
  std::array<char, drivers::axis::kMaxText + 1> text_{};
};

}  // namespace posed::output
