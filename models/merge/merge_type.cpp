#include "models/merge/merge_type.hpp"

#include <string>
#include <utility>

#include "models/merge/merge_plan.hpp"
#include "models/merge/merge_stage.hpp"

namespace posed::merge {
namespace {

std::optional<ParameterFault> check(const Parameters& parameters, bool /*has_model*/) {
  if (!wrist_from_name(parameter<std::string>(parameters, "wrist"))) {
    return ParameterFault{"wrist", R"(wrist takes "auto", "body" or "glove")"};
  }
  return std::nullopt;
}

Result<std::shared_ptr<const Skeleton>> leaves(const StageContext& context) {
  auto plan = MergePlan::make(context);
  if (!plan) return std::unexpected(plan.error());
  return plan->merged.skeleton;
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* /*model*/) {
  auto plan = MergePlan::make(context);
  if (!plan) return std::unexpected(plan.error());
  return std::make_unique<MergeStage>(std::move(*plan));
}

std::vector<ParameterSpec> parameters() {
  return {{.name = "left", .default_value = std::string(), .help = "stream of the left glove"},
          {.name = "right", .default_value = std::string(), .help = "stream of the right glove"},
          {.name = "wait_s",
           .default_value = 0.015,
           .help = "how long a frame waits for the gloves at most",
           .min = 0.0,
           .max = 0.1,
           .people_name = "wait_ms",
           .people_scale = 1000.0},
          {.name = "wrist",
           .default_value = std::string("auto"),
           .help = "who turns the wrist: body, glove, or auto: the glove if it measures it"},
          {.name = "hold_s",
           .default_value = 1.0,
           .help = "how long the hand of a silent glove stays, before it relaxes",
           .min = 0.0,
           .max = 60.0}};
}

}  // namespace

const StageType& merge_type() {
  static const StageType type{.name = "merge",
                              .summary = "puts the hands of gloves on the body",
                              .parameters = parameters(),
                              .partners = {"left", "right"},
                              .input = StageInput::kRenews,
                              .check = check,
                              .leaves = leaves,
                              .make = make};
  return type;
}

}  // namespace posed::merge
