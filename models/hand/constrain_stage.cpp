#include "models/hand/constrain_stage.hpp"

#include <string>
#include <utility>

#include "proto/frame/hand_skeleton.hpp"

namespace posed::hand {
namespace {

// "hand45 right adult" -> adult; the default shape where no built-in shape has that name.
const HandShape& shape_of(const Skeleton& skeleton) {
  const std::string name = skeleton.name.substr(skeleton.name.rfind(' ') + 1);
  const auto shape = find_hand_shape(name);
  return shape ? **shape : default_hand_shape();
}

bool differ(const HandAngles& a, const HandAngles& b) noexcept {
  for (std::size_t c = 0; c < a.size(); ++c) {
    if (a[c] != b[c]) return true;  // true also where one of them is NaN
  }
  return false;
}

}  // namespace

ConstrainStage::ConstrainStage(std::shared_ptr<const Skeleton> skeleton)
    : skeleton_(std::move(skeleton)), solver_(shape_of(*skeleton_)) {}

// RT-safe.
void ConstrainStage::process(const StageFrame& in, StageOut& out) noexcept {
  if (in.frame.skeleton != skeleton_->id) {
    solver_.reset();
    return out.frame(in);
  }
  HandAngles variance{};
  if (in.variance_rad2.size() == variance.size()) {
    for (std::size_t c = 0; c < variance.size(); ++c)
      variance[kAngleOfChannel[c]] = in.variance_rad2[c];
  }
  const HandAngles before = hand_angles(in.frame);
  HandAngles angles = before;
  solver_.step(angles, variance);
  if (!differ(angles, before)) return out.frame(in);
  Frame frame = in.frame;
  set_hand_angles(*skeleton_, angles, frame);
  frame.valid = in.frame.valid;
  frame.root_position_m = in.frame.root_position_m;
  out.frame({.frame = frame, .variance_rad2 = in.variance_rad2, .input = in.input});
}

}  // namespace posed::hand
