// Each new stage adds one line here.
#include "models/stages/registry.hpp"

#include <algorithm>
#include <array>

#include "models/feet/feet_stage.hpp"
#include "models/gate/gate_stage.hpp"
#include "models/generate/generate_stage.hpp"
#include "models/hand/constrain_stage.hpp"
#include "models/merge/merge_stage.hpp"
#include "models/retarget/retarget_stage.hpp"
#include "models/robot/robot_stage.hpp"
#include "models/style/live/style_type.hpp"

namespace posed {

std::span<const StageType* const> stage_types() {
  static const std::array types{
      &gate::gate_type(),         &merge::merge_type(),       &style::style_type(),
      &feet::feet_type(),         &generate::generate_type(), &hand::constrain_type(),
      &retarget::retarget_type(), &robot::robot_type(),
  };
  return types;
}

const StageType* find_stage_type(std::string_view name) {
  const auto at = std::ranges::find(stage_types(), name, &StageType::name);
  return at == stage_types().end() ? nullptr : *at;
}

}  // namespace posed
