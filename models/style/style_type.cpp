#include "models/style/style_type.hpp"

#include "models/style/style_filter.hpp"
#include "models/style/style_model.hpp"
#include "posed/v1/model.pb.h"

namespace posed::style {
namespace {

FilterOptions options_of(const Parameters& parameters) {
  return {.alpha = parameter<double>(parameters, "alpha"),
          .alpha_slew_per_s = parameter<double>(parameters, "alpha_slew_per_s"),
          .gate = parameter<bool>(parameters, "gate"),
          .gate_fallback = parameter<double>(parameters, "gate_fallback"),
          .calibrate = parameter<bool>(parameters, "calibrate")};
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* model) {
  return std::make_unique<StyleFilter>(static_cast<const BoundModel*>(model),
                                       options_of(context.parameters));
}

bool takes(const v1::ModelFile& file) { return file.has_style(); }

Result<std::unique_ptr<const StageModel>> bind(std::span<const std::byte> file,
                                               const StageContext& context,
                                               const std::string& name) {
  const auto model = parse_model(file, name);
  if (!model) return std::unexpected(model.error());
  return bind_model(*model, *context.skeleton, options_of(context.parameters), name);
}

// In the order of StyleFilter::Parameter.
std::vector<ParameterSpec> parameters() {
  const FilterOptions defaults;
  return {{.name = "alpha",
           .default_value = defaults.alpha,
           .help = "how much style: 0 none, 1 as trained, 2 twice as much, -1 the opposite",
           .min = -kMaxAlpha,
           .max = kMaxAlpha,
           .live = true},
          {.name = "alpha_slew_per_s",
           .default_value = defaults.alpha_slew_per_s,
           .help = "how fast alpha moves to a new value",
           .min = 0.01,
           .max = 1000.0,
           .live = true},
          {.name = "gate",
           .default_value = defaults.gate,
           .help = "fade the style out far from the poses that the model was trained on"},
          {.name = "gate_fallback",
           .default_value = defaults.gate_fallback,
           .help = "what the gate fades to: 0 nothing, 1 the model's constant part",
           .min = 0.0,
           .max = 1.0,
           .live = true},
          {.name = "calibrate",
           .default_value = defaults.calibrate,
           .help = "remove the performer's own mean posture before the model sees the pose",
           .live = true}};
}

}  // namespace

const StageType& style_type() {
  static const StageType type{.name = "style",
                              .summary = "changes the style of every pose, as a trained model says",
                              .parameters = parameters(),
                              .make = make,
                              .model_required = true,
                              .takes = takes,
                              .bind_model = bind};
  return type;
}

}  // namespace posed::style
