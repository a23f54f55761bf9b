#include "models/hand/constrain_stage.hpp"

#include <memory>
#include <utility>

#include "models/hand/constraint_solver.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::hand {
namespace {

bool differ(const HandAngles& a, const HandAngles& b) noexcept {
  for (std::size_t c = 0; c < a.size(); ++c) {
    if (a[c] != b[c]) return true;  // true also where one of them is NaN
  }
  return false;
}

class ConstrainStage final : public Stage {
 public:
  // `skeleton` is a hand (hand_side() recognises it); its name selects the hand shape.
  explicit ConstrainStage(std::shared_ptr<const Skeleton> skeleton);

  // Moves the frame's angles to the nearest that are allowed; an angle that is known well moves
  // less. A hand that lacks an angle is left alone.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  ConstraintSolver solver_;
};

ConstrainStage::ConstrainStage(std::shared_ptr<const Skeleton> skeleton)
    : skeleton_(std::move(skeleton)), solver_(shape_of(*skeleton_)) {}

RT_SAFE void ConstrainStage::process(const StageFrame& in, StageOut& out) noexcept {
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

bool is_hand(const Skeleton& skeleton) { return hand_side(skeleton).has_value(); }

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* /*model*/) {
  if (!is_hand(*context.skeleton)) {
    return misuse("only hands (hand45) can be constrained; leave out its [stream.constrain] table");
  }
  return std::make_unique<ConstrainStage>(context.skeleton);
}

}  // namespace

const StageType& constrain_type() {
  static const StageType type{
      .name = "constrain",
      .summary = "keeps the fingers of a hand apart and its joints within their limits",
      .words = "keep fingers apart",
      .is_default = [](const Skeleton& skeleton, bool /*bridged*/) { return is_hand(skeleton); },
      .make = make};
  return type;
}

}  // namespace posed::hand
