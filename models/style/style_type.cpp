#include "models/style/style_type.hpp"

#include "models/style/style_filter.hpp"
#include "models/style/style_model.hpp"
#include "posed/v1/log.pb.h"
#include "posed/v1/model.pb.h"

namespace posed::style {
namespace {

FilterOptions options_of(const Parameters& parameters) {
  return {.alpha = parameter<double>(parameters, "alpha"),
          .alpha_slew_per_s = parameter<double>(parameters, "alpha_slew_per_s"),
          .gate = parameter<bool>(parameters, "gate"),
          .gate_fallback = parameter<double>(parameters, "gate_fallback"),
          .calibrate = parameter<bool>(parameters, "calibrate"),
          .auto_alpha = parameter<bool>(parameters, "auto_alpha")};
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
  return bind_model(*model, *context.skeleton, name);
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
           .help = "fade the style out where the model does not know the motion",
           .live = true},
          {.name = "gate_fallback",
           .default_value = defaults.gate_fallback,
           .help = "what the gate fades to: 0 the input, 1 the model's constant part",
           .min = 0.0,
           .max = 1.0,
           .live = true},
          {.name = "calibrate",
           .default_value = defaults.calibrate,
           .help = "the older name of warm_up_s = 10",
           .live = true},
          {.name = "auto_alpha",
           .default_value = defaults.auto_alpha,
           .help = "less style for a walker who shows it already",
           .live = true},
          {.name = "warm_up_s",
           .default_value = 0.0,
           .help = "measure the walker's own neutral pose so long at the start; 0: do not",
           .min = 0.0,
           .max = kLongestWarmUp_s}};
}

// In the order of StyleFilter::Reading.
std::vector<StageReadingType> readings() {
  return {{.name = "style_estimate", .help = "how much of the style the walker shows already"},
          {.name = "style_gate", .help = "1 where the model knows the motion, 0 passed through"}};
}

// In the order of WalkerWatch::Notice.
std::vector<StageNoticeType> notices() {
  return {
      {.sentence = "the model has no data for gate, warm-up and auto-alpha, so any motion is "
                   "styled in full: train it again with this version of posed, or set gate = "
                   "false"},
      {.sentence = "the warm-up is over: the walker's own neutral pose is known",
       .is_warning = false},
      {.sentence = "the walker stood for more than half of the warm-up, so all stays as it was: "
                   "walk, and start it again"},
      {.sentence = "the warm-up was interrupted, so all stays as it was: start it again"},
      {.sentence = "the new model sees other joints, so what is known of the walker does not "
                   "serve it: start a warm-up"},
      {.sentence = "calibrate is the older name of a warm-up: use warm_up_s = 10, or `posed ctl "
                   "warm-up STREAM`"}};
}

std::optional<ParameterFault> check(const Parameters& parameters, bool /*has_model*/) {
  const double seconds = parameter<double>(parameters, "warm_up_s");
  if (seconds == 0.0 || seconds >= kShortestWarmUp_s) return std::nullopt;
  return ParameterFault{"warm_up_s",
                        "warm_up_s is too short to measure a walk: give at least 2, or 0 for none"};
}

Result<StageCommand> warm_up(const StageModel* model, std::span<const std::string> words,
                             const Parameters& options) {
  if (model == nullptr) return fail("there is no style model to warm up for");
  if (!words.empty()) return misuse("warm-up takes --seconds only");
  return StageCommand::of(parameter<double>(options, "seconds"));
}

void warm_up_to_log(const StageCommand& command, v1::DecisionValue& value) {
  value.set_number(command.as<double>());
}

std::optional<StageCommand> warm_up_from_log(const v1::DecisionValue& value) {
  const double seconds = value.number();
  if (!(seconds >= kShortestWarmUp_s && seconds <= kLongestWarmUp_s)) return std::nullopt;
  return StageCommand::of(seconds);
}

// In the order of StyleFilter::Command.
std::vector<StageCommandType> commands() {
  return {{.name = "warm-up",
           .help = "measures the walker's own neutral pose while it walks",
           .options = {{.name = "seconds",
                        .default_value = kUsualWarmUp_s,
                        .help = "how long it walks",
                        .min = kShortestWarmUp_s,
                        .max = kLongestWarmUp_s}},
           .refusal = "the model has no data for a warm-up: train it again with this version of "
                      "posed",
           .encode = warm_up,
           .to_log = warm_up_to_log,
           .from_log = warm_up_from_log}};
}

Result<std::optional<StageType::FirstCommand>> first_command(const Parameters& parameters,
                                                             const StageModel* /*model*/) {
  double seconds = parameter<double>(parameters, "warm_up_s");
  if (seconds == 0.0 && parameter<bool>(parameters, "calibrate")) seconds = kUsualWarmUp_s;
  if (seconds == 0.0) return std::nullopt;
  return StageType::FirstCommand{StyleFilter::kWarmUp, StageCommand::of(seconds)};
}

}  // namespace

const StageType& style_type() {
  static const StageType type{.name = "style",
                              .summary = "changes the style of every pose, as a trained model says",
                              .parameters = parameters(),
                              .check = check,
                              .make = make,
                              .model_required = true,
                              .takes = takes,
                              .bind_model = bind,
                              .readings = readings(),
                              .notices = notices(),
                              .commands = commands(),
                              .first_command = first_command};
  return type;
}

}  // namespace posed::style
