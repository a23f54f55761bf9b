// What of a stream's config the pipeline runs by, as the device log keeps it (stream.stages_json):
// JSON with every default filled in, so that a log means the same when defaults change. Numbers
// come back to the bit.
#pragma once

#include <optional>
#include <string>

#include "drivers/driver.hpp"
#include "models/smooth/live_options.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/result.hpp"

namespace posed::record {

// The model that a stage began with.
struct StageModel {
  std::string sha256{};  // of its file, which the log keeps; empty: it had none
  std::string name{};    // for people
};

struct StreamSettings {
  bool publish_raw = false;
  double stale_after_s = 0.5;
  double rate_hz = 0.0;                         // the device's nominal rate; 0 unknown
  std::optional<style::FilterOptions> style{};  // the style stage is there when this is
  StageModel style_model{};
  std::optional<smooth::LiveOptions> generate{};  // the generate stage is there when this is
  StageModel gesture_model{};
  bool constrain = false;  // the constrain stage is there
};

[[nodiscard]] std::string to_json(const StreamSettings& settings);
// `file` is the log's name, for the error. Stages that this posed does not have are refused.
[[nodiscard]] Result<StreamSettings> settings_from_json(const std::string& json,
                                                        const std::string& file);

// source.config: a driver's options, as it was opened with them.
[[nodiscard]] std::string to_json(const drivers::Options& options);

}  // namespace posed::record
