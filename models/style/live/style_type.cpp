#include "models/style/live/style_type.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "models/style/live/apply.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/live/warm_up.hpp"
#include "models/style/model/style_model.hpp"
#include "posed/v1/log.pb.h"
#include "posed/v1/model.pb.h"
#include "proto/clip/clip.hpp"
#include "proto/text/list.hpp"

namespace posed::style {
namespace {

const BoundModel* style_of(const StageModel* model) {
  return static_cast<const BoundModel*>(model);
}

// What does not depend on the model.
std::optional<ParameterFault> check(const Parameters& parameters, bool /*has_model*/) {
  const double seconds = parameter<double>(parameters, "warm_up_s");
  if (seconds != 0.0 && seconds < kMinWarmUp_s) {
    return ParameterFault{
        "warm_up_s", "warm_up_s is too short to measure a walk: give at least 2, or 0 for none"};
  }
  if (seconds != 0.0 && !parameter<std::string>(parameters, "neutral").empty()) {
    return ParameterFault{
        "neutral", "neutral and a warm-up at the start both tell how the walker walks: give one"};
  }
  const auto weights = check_weights(parameter<std::string>(parameters, "weights"));
  if (!weights) return ParameterFault{"weights", weights.error().message};
  const auto mask = mask_of(parameter<std::string>(parameters, "mask"));
  if (!mask) return ParameterFault{"mask", mask.error().message};
  return std::nullopt;
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* model) {
  const FilterOptions options = StyleFilter::table().options(context.parameters);
  if (model != nullptr) {
    const auto shares = shares_of(options.weights, style_of(model)->styles());
    if (!shares) return fail(shares.error().message, model->name);
  }
  return std::make_unique<StyleFilter>(style_of(model), options, context.skeleton);
}

bool takes(const v1::ModelFile& file) { return file.has_style(); }

Result<std::unique_ptr<const StageModel>> bind(std::span<const std::byte> file,
                                               const StageContext& context,
                                               const std::string& name) {
  const auto model = TRY(parse_model(file, name));
  return bind_model(model, *context.skeleton, name);
}

Result<StageCommand> set_weights(const StageModel* model, std::span<const std::string> words,
                                 const Parameters& /*options*/) {
  if (model == nullptr) {
    return fail("there is no style model; send one with `posed ctl model STREAM M.style`");
  }
  // A live text comes in pieces that end at its commas.
  const auto shares = TRY(shares_of(joined(words, ","), style_of(model)->styles()));
  return StageCommand::of(shares);
}

Result<StageCommand> set_mask(const StageModel* /*model*/, std::span<const std::string> words,
                              const Parameters& /*options*/) {
  const auto mask = TRY(mask_of(joined(words, ",")));
  return StageCommand::of(mask);
}

void write_numbers(std::span<const double> numbers, v1::DecisionValue& value) {
  for (const double number : numbers) value.mutable_weights()->add_weight(number);
}

// Numbers from 0 to 1; empty if there are none or others.
std::vector<double> read_numbers(const v1::DecisionValue& value, std::size_t most) {
  const auto& list = value.weights().weight();
  const bool valid = value.has_weights() && static_cast<std::size_t>(list.size()) <= most &&
                     std::ranges::all_of(list, [](double n) { return n >= 0.0 && n <= 1.0; });
  return valid ? std::vector<double>(list.begin(), list.end()) : std::vector<double>();
}

void weights_to_log(const StageCommand& command, v1::DecisionValue& value) {
  const auto shares = command.as<Shares>();
  write_numbers(shares.all(), value);
}

std::optional<StageCommand> weights_from_log(const v1::DecisionValue& value) {
  constexpr double kRounding = 1e-9;
  const auto numbers = read_numbers(value, kMaxStyles);
  const double sum = std::accumulate(numbers.begin(), numbers.end(), 0.0);
  if (numbers.empty() || std::abs(sum - 1.0) > kRounding) return std::nullopt;
  Shares shares{.count = static_cast<std::uint16_t>(numbers.size())};
  std::ranges::copy(numbers, shares.of.begin());
  return StageCommand::of(shares);
}

void mask_to_log(const StageCommand& command, v1::DecisionValue& value) {
  write_numbers(command.as<Mask>(), value);
}

std::optional<StageCommand> mask_from_log(const v1::DecisionValue& value) {
  const auto numbers = read_numbers(value, kBodyParts);
  if (numbers.size() != kBodyParts) return std::nullopt;
  Mask mask{};
  std::ranges::copy(numbers, mask.begin());
  return StageCommand::of(mask);
}

// In the order of StyleFilter::Reading.
std::vector<StageReadingType> readings() {
  return {{.name = "style_estimate", .help = "how much of the style the walker shows already"},
          {.name = "style_gate", .help = "1 where the model knows the motion, 0 passed through"}};
}

// In the order of WalkerTracker::Notice, then StyleFilter's.
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
      {.sentence = "the model has no style axis, so auto_alpha does nothing: train a model of one "
                   "style with this version of posed, or set auto_alpha = false"},
      {.sentence = "alpha is held back: more of this style would put arms into the head or the "
                   "trunk of this figure"},
      {.sentence = "knees or elbows are kept from bending backwards, which this alpha would have "
                   "them do"}};
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
  if (!(seconds >= kMinWarmUp_s && seconds <= kMaxWarmUp_s)) return std::nullopt;
  return StageCommand::of(seconds);
}

Result<StageCommand> refuse_neutral(const StageModel* /*model*/,
                                    std::span<const std::string> /*words*/,
                                    const Parameters& /*options*/) {
  return misuse(
      "a walker's clip is named in the config (neutral = \"N.bvh\"), because nothing from "
      "the network names a file; or use `posed ctl warm-up STREAM`");
}

// In the order of StyleFilter::Command.
std::vector<StageCommandType> commands() {
  return {{.name = "warm-up",
           .help = "measures the walker's own neutral pose while it walks",
           .options = {{.name = "seconds",
                        .default_value = kUsualWarmUp_s,
                        .help = "how long it walks",
                        .min = kMinWarmUp_s,
                        .max = kMaxWarmUp_s}},
           .refusal = "the model has no data for a warm-up: train it again with this version of "
                      "posed",
           .encode = warm_up,
           .to_log = warm_up_to_log,
           .from_log = warm_up_from_log},
          // What sets the live texts (models/live_text.hpp).
          {.name = "weights",
           .help = "mixes the model's styles",
           .refusal = "the weights are for the model before the one that has just come; send them"
                      " again",
           .encode = set_weights,
           .to_log = weights_to_log,
           .from_log = weights_from_log},
          {.name = "mask",
           .help = "styles parts of the body less",
           .encode = set_mask,
           .to_log = mask_to_log,
           .from_log = mask_from_log},
          // What the parameter `neutral` asks for; a name of its own, as the log tells them apart.
          {.name = "know-walker",
           .help = "makes the walker known from a clip",
           .encode = refuse_neutral,
           .to_log = walker_to_log,
           .from_log = walker_from_log}};
}

// A clip of the walker's usual walk stands for a warm-up.
Result<StageCommand> neutral_of_clip(const std::string& path, const StageModel& model,
                                     std::span<const std::byte> file) {
  const auto style = TRY(parse_model(file, model.name));
  const auto clip = TRY(clip::read_clip(path));
  const auto walker = TRY(measure_walker(style, model.name, clip));
  return command_of(walker);
}

Result<std::optional<StageType::FirstCommand>> first_command(const Parameters& parameters,
                                                             const StageModel* model,
                                                             std::span<const std::byte> file) {
  const auto neutral = parameter<std::string>(parameters, "neutral");
  if (!neutral.empty() && model != nullptr) {
    const auto command = TRY(neutral_of_clip(neutral, *model, file));
    return StageType::FirstCommand{StyleFilter::kNeutral, command};
  }
  const double seconds = parameter<double>(parameters, "warm_up_s");
  if (seconds == 0.0) return std::nullopt;
  return StageType::FirstCommand{StyleFilter::kWarmUp, StageCommand::of(seconds)};
}

}  // namespace

const StageType& style_type() {
  static const StageType type{.name = "style",
                              .summary = "changes the style of every pose, as a trained model says",
                              .parameters = StyleFilter::table().specs(),
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
