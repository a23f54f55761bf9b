#include "models/hand/constrain_type.hpp"

#include "models/hand/constrain_stage.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::hand {
namespace {

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
      .is_default = is_hand,
      .make = make};
  return type;
}

}  // namespace posed::hand
