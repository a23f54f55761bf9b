// What of a stream's config the pipeline runs by, as the device log keeps it (stream.config): JSON
// with every default filled in, so that a log means the same when defaults change. Numbers come
// back to the bit.
#pragma once

#include <optional>
#include <string>

#include "models/generate/live_options.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/result.hpp"

namespace posed::record {

struct StreamSettings {
  bool publish_raw = false;
  double stale_after_s = 0.5;
  double rate_hz = 0.0;                           // the device's nominal rate; 0 unknown
  std::optional<style::FilterOptions> style;      // the style stage is there when this is
  std::string model_name;                         // for people
  std::optional<generate::LiveOptions> generate;  // the generate stage is there when this is
  bool constrain = false;                         // the constrain stage is there
  std::string gesture_model;  // SHA-256 of the gesture model that it began with; may be empty
};

[[nodiscard]] std::string to_json(const StreamSettings& settings);
// `file` is the log's name, for the error.
[[nodiscard]] Result<StreamSettings> settings_from_json(const std::string& json,
                                                        const std::string& file);

}  // namespace posed::record
