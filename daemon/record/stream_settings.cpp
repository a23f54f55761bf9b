#include "daemon/record/stream_settings.hpp"

#include <utility>

#include <nlohmann/json.hpp>

#include "proto/log/rows.hpp"
#include "proto/text/json_text.hpp"

namespace posed::record {

namespace {

using Json = nlohmann::ordered_json;
namespace words = log::words;

bool sound(const StreamSettings& settings) {
  constexpr double kMaxSetting =
      1e6;  // seconds, Hz, per second: far beyond sense, far below overflow
  const auto within = [](double value) { return value >= -kMaxSetting && value <= kMaxSetting; };
  const style::FilterOptions style = settings.style.value_or(style::FilterOptions{});
  const smooth::LiveOptions live = settings.generate.value_or(smooth::LiveOptions{});
  return settings.stale_after_s > 0.0 && within(settings.stale_after_s) &&
         within(settings.rate_hz) && within(style.alpha) && within(style.alpha_slew_per_s) &&
         within(style.gate_fallback) && live.lag.frames >= 0 && live.lag.frames <= 1000 &&
         live.lag.seconds >= 0.0 && within(live.lag.seconds) && live.noise_rad >= 0.0 &&
         within(live.noise_rad);
}

Json stage(const char* name, const StageModel& model, Json parameters) {
  return {{"stage", name},
          {"model", model.sha256},
          {"model_name", model.name},
          {"parameters", std::move(parameters)}};
}

StageModel model_of(const Json& stage) {
  return {.sha256 = stage.value("model", ""), .name = stage.value("model_name", "")};
}

style::FilterOptions style_of(const Json& parameters) {
  return {.alpha = parameters.at("alpha").get<double>(),
          .alpha_slew_per_s = parameters.at("alpha_slew_per_s").get<double>(),
          .gate = parameters.at("gate").get<bool>(),
          .gate_fallback = parameters.at("gate_fallback").get<double>(),
          .calibrate = parameters.at("calibrate").get<bool>()};
}

smooth::LiveOptions generate_of(const Json& parameters) {
  return {.lag = {.frames = parameters.at("lag_frames").get<int>(),
                  .seconds = parameters.at("lag_s").get<double>()},
          .noise_rad = parameters.at("noise_rad").get<double>()};
}

// False if this version of posed does not have the stage, or runs it in another order.
bool add_stage(const Json& stage, StreamSettings& settings) {
  const auto name = stage.at("stage").get<std::string>();
  if (name == words::kStyle && !settings.style && !settings.generate && !settings.constrain) {
    settings.style = style_of(stage.at("parameters"));
    settings.style_model = model_of(stage);
    return true;
  }
  if (name == words::kGenerate && !settings.generate && !settings.constrain) {
    settings.generate = generate_of(stage.at("parameters"));
    settings.gesture_model = model_of(stage);
    return true;
  }
  if (name == words::kConstrain && !settings.constrain) return settings.constrain = true;
  return false;
}

}  // namespace

std::string to_json(const StreamSettings& settings) {
  Json stages = Json::array();
  if (settings.style) {
    stages.push_back(stage(words::kStyle, settings.style_model,
                           {{"alpha", settings.style->alpha},
                            {"alpha_slew_per_s", settings.style->alpha_slew_per_s},
                            {"gate", settings.style->gate},
                            {"gate_fallback", settings.style->gate_fallback},
                            {"calibrate", settings.style->calibrate}}));
  }
  if (settings.generate) {
    stages.push_back(stage(words::kGenerate, settings.gesture_model,
                           {{"lag_frames", settings.generate->lag.frames},
                            {"lag_s", settings.generate->lag.seconds},
                            {"noise_rad", settings.generate->noise_rad}}));
  }
  if (settings.constrain) {
    stages.push_back({{"stage", words::kConstrain}, {"parameters", Json::object()}});
  }
  return json_text(Json{{"publish_raw", settings.publish_raw},
                        {"stale_after_s", settings.stale_after_s},
                        {"rate_hz", settings.rate_hz},
                        {"stages", std::move(stages)}});
}

Result<StreamSettings> settings_from_json(const std::string& json, const std::string& file) {
  try {
    const auto root = Json::parse(json);
    StreamSettings settings;
    settings.publish_raw = root.at("publish_raw").get<bool>();
    settings.stale_after_s = root.at("stale_after_s").get<double>();
    settings.rate_hz = root.at("rate_hz").get<double>();
    for (const Json& stage : root.at("stages")) {
      if (add_stage(stage, settings)) continue;
      return fail("this posed cannot run the stages of a stream as recorded in the log (" +
                      json_text(stage.at("stage")) + "); update posed",
                  file);
    }
    if (!sound(settings)) return fail("the log is damaged (a stream's settings are invalid)", file);
    return settings;
  } catch (const nlohmann::json::exception& error) {
    return fail("the log is damaged (a stream's settings: " + std::string(error.what()) + ")",
                file);
  }
}

std::string to_json(const drivers::Options& options) {
  Json json = Json::object();
  for (const auto& [name, value] : options) {
    std::visit([&, key = name](const auto& it) { json[key] = it; }, value);
  }
  return json_text(json);
}

}  // namespace posed::record
