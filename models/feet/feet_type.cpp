#include "models/feet/feet_type.hpp"

#include <string>
#include <string_view>
#include <utility>

#include "models/feet/feet_stage.hpp"

namespace posed::feet {
namespace {

RootOptions options_of(const Parameters& parameters) {
  return {.mode = *root_mode(parameter<std::string>(parameters, "root")),
          .limit_m = parameter<double>(parameters, "limit_m")};
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* /*model*/) {
  auto legs = Legs::find(*context.skeleton);
  if (!legs) return std::unexpected(legs.error());
  return std::make_unique<FeetStage>(context.skeleton, std::move(*legs), context.rate_hz,
                                     options_of(context.parameters));
}

// In the order of FeetStage::Parameter.
std::vector<ParameterSpec> parameters() {
  const RootOptions defaults;
  return {{.name = "root",
           .default_value = std::string(root_name(defaults.mode)),
           .help = "stride: it walks as far as its own legs do; actor: it stays on the performer,"
                   " and its legs reach for the ground; off: feet slide",
           .live = true,
           .words = kRootModes},
          {.name = "limit_m",
           .default_value = defaults.limit_m,
           .help = "actor: how far the root may be from the performer's",
           .min = 0.0,
           .max = 0.5,
           .live = true,
           .people_name = "limit_cm",
           .people_scale = 100.0}};
}

}  // namespace

const StageType& feet_type() {
  static const StageType type{.name = "feet",
                              .summary = "makes the feet of a styled body stand",
                              .parameters = parameters(),
                              .needs_input = true,
                              .make = make};
  return type;
}

}  // namespace posed::feet
