// What of a stream's config its engine runs by. The live daemon fills it from the config, replay
// from the device log; engine_options() then makes the same engine of it for both.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "daemon/pipeline/stream_engine.hpp"
#include "models/smooth/live_options.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::pipeline {

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

// The engine of stream number `stream` with this skeleton (null: samples only), still without
// models. Cold.
[[nodiscard]] EngineOptions engine_options(std::uint32_t stream, const StreamSettings& settings,
                                           std::shared_ptr<const Skeleton> skeleton);

}  // namespace posed::pipeline
