#include "daemon/record/stream_settings.hpp"

#include <nlohmann/json.hpp>

namespace posed::record {

namespace {

bool sound(const StreamSettings& settings) {
  constexpr double kMost = 1e6;  // seconds, Hz, per second: far beyond sense, far below overflow
  const auto within = [](double value) { return value >= -kMost && value <= kMost; };
  const style::FilterOptions style = settings.style.value_or(style::FilterOptions{});
  const generate::LiveOptions live = settings.generate.value_or(generate::LiveOptions{});
  return settings.stale_after_s > 0.0 && within(settings.stale_after_s) &&
         within(settings.rate_hz) && within(style.alpha) && within(style.alpha_slew_per_s) &&
         within(style.gate_fallback) && live.lag.frames >= 0 && live.lag.frames <= 1000 &&
         live.lag.seconds >= 0.0 && within(live.lag.seconds) && live.noise_rad >= 0.0 &&
         within(live.noise_rad);
}

}  // namespace

std::string to_json(const StreamSettings& settings) {
  nlohmann::ordered_json json{{"publish_raw", settings.publish_raw},
                              {"stale_after_s", settings.stale_after_s},
                              {"rate_hz", settings.rate_hz},
                              {"model_name", settings.model_name}};
  if (settings.style) {
    json["style"] = {{"alpha", settings.style->alpha},
                     {"alpha_slew_per_s", settings.style->alpha_slew_per_s},
                     {"gate", settings.style->gate},
                     {"gate_fallback", settings.style->gate_fallback},
                     {"calibrate", settings.style->calibrate}};
  }
  if (settings.constrain) json["constrain"] = true;
  if (settings.generate) {
    json["generate"] = {{"lag_frames", settings.generate->lag.frames},
                        {"lag_s", settings.generate->lag.seconds},
                        {"noise_rad", settings.generate->noise_rad},
                        {"model", settings.gesture_model}};
  }
  return json.dump();
}

Result<StreamSettings> settings_from_json(const std::string& json, const std::string& file) {
  try {
    const auto root = nlohmann::json::parse(json);
    StreamSettings settings{.publish_raw = root.at("publish_raw").get<bool>(),
                            .stale_after_s = root.at("stale_after_s").get<double>(),
                            .rate_hz = root.at("rate_hz").get<double>(),
                            .style = std::nullopt,
                            .model_name = root.at("model_name").get<std::string>(),
                            .generate = std::nullopt,
                            .constrain = false,
                            .gesture_model = {}};
    if (root.contains("style")) {
      const auto& style = root.at("style");
      settings.style =
          style::FilterOptions{.alpha = style.at("alpha").get<double>(),
                               .alpha_slew_per_s = style.at("alpha_slew_per_s").get<double>(),
                               .gate = style.at("gate").get<bool>(),
                               .gate_fallback = style.at("gate_fallback").get<double>(),
                               .calibrate = style.at("calibrate").get<bool>()};
    }
    settings.constrain = root.value("constrain", false);
    if (root.contains("generate")) {
      const auto& generate = root.at("generate");
      settings.generate =
          generate::LiveOptions{.lag = {.frames = generate.at("lag_frames").get<int>(),
                                        .seconds = generate.at("lag_s").get<double>()},
                                .noise_rad = generate.at("noise_rad").get<double>()};
      settings.gesture_model = generate.at("model").get<std::string>();
    }
    if (!sound(settings))
      return fail("the log is damaged (a stream's settings make no sense)", file);
    return settings;
  } catch (const nlohmann::json::exception& error) {
    return fail("the log is damaged (a stream's settings: " + std::string(error.what()) + ")",
                file);
  }
}

}  // namespace posed::record
