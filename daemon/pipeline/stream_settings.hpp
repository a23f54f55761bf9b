// The settings by which a stream's engine runs. The live daemon fills them from the config, replay
// from the device log; engine_options() makes the same engine from them for both.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "daemon/pipeline/stream_engine.hpp"
#include "models/smooth/live_options.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::pipeline {

// The model with which a stage started.
struct StageModel {
  std::string sha256{};  // of its file, which the log keeps; empty: no model
  std::string name{};    // human-readable
};

struct StreamSettings {
  bool publish_raw = false;
  double stale_after_s = 0.5;
  double rate_hz = 0.0;                         // the device's nominal rate; 0: unknown
  std::optional<style::FilterOptions> style{};  // set: the stream has a style stage
  StageModel style_model{};
  std::optional<smooth::LiveOptions> generate{};  // set: the stream has a generate stage
  StageModel gesture_model{};
  bool constrain = false;  // true: the stream has a constrain stage
};

// The options of the engine of stream number `stream`, without models, which the caller adds.
// `skeleton` is null for a stream that has samples only. Cold.
[[nodiscard]] EngineOptions engine_options(std::uint32_t stream, const StreamSettings& settings,
                                           std::shared_ptr<const Skeleton> skeleton);

}  // namespace posed::pipeline
