#include "models/generate/generate_type.hpp"

#include <limits>
#include <utility>

#include "models/generate/generate_stage.hpp"
#include "models/gesture/model_file.hpp"
#include "models/gesture/play_order.hpp"
#include "posed/v1/log.pb.h"
#include "posed/v1/model.pb.h"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"

namespace posed::generate {
namespace {

using gesture::PlayOrder;

// Above 60 Hz the lag is limited as a time; at no frame rate is that time longer than this many
// frames.
constexpr double kMaxLagFrames = 170.0;
constexpr double kMaxNoise_rad = 90.0 * kDegree;

smooth::LiveOptions options_of(const Parameters& parameters) {
  return {.lag = {.frames = static_cast<int>(parameter<std::int64_t>(parameters, "lag_frames")),
                  .seconds = parameter<double>(parameters, "lag_s")},
          .noise_rad = parameter<double>(parameters, "noise_rad")};
}

const gesture::GestureModel* gesture_of(const StageModel* model) {
  return model == nullptr ? nullptr : &static_cast<const BoundModel*>(model)->gesture();
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* model) {
  if (context.skeleton->channels.empty() && model == nullptr) {
    return misuse("skeleton " + in_quotes(context.skeleton->name) +
                  " has no joint angles, so there is nothing to generate without a gesture model "
                  "of a body");
  }
  return std::make_unique<GenerateStage>(context.skeleton, options_of(context.parameters),
                                         stream_rate_hz(context.rate_hz),
                                         static_cast<const BoundModel*>(model));
}

bool takes(const v1::ModelFile& file) { return file.has_gesture(); }

Result<std::unique_ptr<const StageModel>> bind(std::span<const std::byte> file,
                                               const StageContext& context,
                                               const std::string& name) {
  auto model = gesture::parse_model(file, name);
  if (!model) return std::unexpected(model.error());
  return bind_model(std::move(*model), *context.skeleton, context.rate_hz, name);
}

std::optional<ParameterFault> check(const Parameters& parameters, bool has_model) {
  const auto labels = gesture::split_labels(parameter<std::string>(parameters, "labels"));
  if (labels.size() > gesture::kMaxLabels) {
    return ParameterFault{"labels", std::to_string(labels.size()) +
                                        " labels are too many at once; give at most " +
                                        std::to_string(gesture::kMaxLabels)};
  }
  if (!labels.empty() && !has_model) {
    return ParameterFault{"labels",
                          "labels need a gesture model to perform them; add model = \"H.gesture\""};
  }
  return std::nullopt;
}

Result<StageCommand> play(const StageModel* model, std::span<const std::string> words,
                          const Parameters& options) {
  if (model == nullptr) {
    return fail("there is no gesture model; send one with `posed ctl model STREAM H.gesture`");
  }
  const auto order =
      gesture::make_play_order(*gesture_of(model), words, parameter<double>(options, "tempo"),
                               parameter<bool>(options, "loop"));
  if (!order) return std::unexpected(order.error());
  return StageCommand::of(*order);
}

void play_to_log(const StageCommand& command, v1::DecisionValue& value) {
  const auto order = command.as<PlayOrder>();
  for (const std::uint16_t label : order.labels()) value.mutable_play()->add_label(label);
  value.mutable_play()->set_tempo(order.tempo);
  value.mutable_play()->set_loop(order.loop);
}

std::optional<StageCommand> play_from_log(const v1::DecisionValue& value) {
  constexpr std::uint32_t kMaxLabelIndex = std::numeric_limits<std::uint16_t>::max();
  PlayOrder order;
  const auto& play = value.play();
  const auto count = static_cast<std::size_t>(play.label_size());
  if (!value.has_play() || count == 0 || count > order.label.size()) return std::nullopt;
  for (const std::uint32_t label : play.label()) {
    if (label > kMaxLabelIndex) return std::nullopt;
    order.label[order.size++] = static_cast<std::uint16_t>(label);
  }
  order.tempo = play.tempo();
  order.loop = play.loop();
  const bool possible = order.tempo >= static_cast<float>(gesture::kMinTempo) &&
                        order.tempo <= static_cast<float>(gesture::kMaxTempo);
  return possible ? std::optional(StageCommand::of(order)) : std::nullopt;
}

Result<StageCommand> stop_playing(const StageModel* model, std::span<const std::string> words,
                                  const Parameters& /*options*/) {
  if (model == nullptr) return fail("nothing is performed here: there is no gesture model");
  if (!words.empty()) return misuse("stop-playing takes no labels");
  return StageCommand{};
}

std::vector<ParameterSpec> play_options() {
  return {{.name = "tempo",
           .default_value = 1.0,
           .help = "of the labels: 2 is twice as fast as learnt",
           .min = gesture::kMinTempo,
           .max = gesture::kMaxTempo},
          {.name = "loop", .default_value = false, .help = "repeat the labels until others come"}};
}

// The parameters of the smoother, then what is performed from the start.
std::vector<ParameterSpec> parameters() {
  const smooth::LiveOptions defaults;
  std::vector<ParameterSpec> table{
      {.name = "lag_frames",
       .default_value = std::int64_t{defaults.lag.frames},
       .help = "frames by which the output lags behind; more are smoother",
       .min = 0.0,
       .max = kMaxLagFrames},
      {.name = "lag_s",
       .default_value = defaults.lag.seconds,
       .help = "the lag as a time instead; 0: use lag_frames",
       .min = 0.0,
       .max = smooth::kMaxLag_s,
       .people_name = "lag_ms",
       .people_scale = 1e3},
      {.name = "noise_rad",
       .default_value = defaults.noise_rad,
       .help = "standard deviation of the sensor's noise; 0: estimated from the stream",
       .min = 0.0,
       .max = kMaxNoise_rad,
       .people_name = "noise_deg",
       .people_scale = 1.0 / kDegree},
      {.name = "labels",
       .default_value = std::string(),
       .help = "performed from the start: \"g 1 c\""}};
  for (ParameterSpec& option : play_options()) table.push_back(std::move(option));
  return table;
}

// In the order of GenerateStage::Command.
std::vector<StageCommandType> commands() {
  return {{.name = "play",
           .help = "performs labels, after those that still wait",
           .options = play_options(),
           .performs = true,
           .refusal = "too many labels wait already; try again later, or stop them with `posed ctl"
                      " stop-playing STREAM`",
           .encode = play,
           .to_log = play_to_log,
           .from_log = play_from_log},
          {.name = "stop-playing",
           .help = "back to the live pose, or to rest",
           .encode = stop_playing}};
}

Result<std::optional<StageType::FirstCommand>> first_command(const Parameters& parameters,
                                                             const StageModel* model,
                                                             std::span<const std::byte> /*file*/) {
  const auto labels = gesture::split_labels(parameter<std::string>(parameters, "labels"));
  if (labels.empty()) return std::nullopt;
  const auto command = play(model, labels, parameters);
  if (!command) return std::unexpected(command.error());
  return StageType::FirstCommand{GenerateStage::kPlay, *command};
}

}  // namespace

const StageType& generate_type() {
  static const StageType type{
      .name = "generate",
      .summary =
          "smooths joint angles, and performs labels from a gesture model on a hand or a body",
      .parameters = parameters(),
      .input = StageInput::kLoses,
      .check = check,
      .make = make,
      .takes = takes,
      .bind_model = bind,
      .commands = commands(),
      .first_command = first_command};
  return type;
}

}  // namespace posed::generate
