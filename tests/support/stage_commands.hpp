// Changes to the stages of a stream, as control sends them, and stages for an engine.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/pipeline/stream_settings.hpp"
#include "models/generate/bound_model.hpp"
#include "models/generate/generate_stage.hpp"
#include "models/gesture/play_order.hpp"
#include "models/hand/constrain_stage.hpp"
#include "models/style/live/style_filter.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/support/parameter_index.hpp"

namespace posed::test {

inline pipeline::Command alpha_command(std::uint32_t stream, double alpha,
                                       std::uint64_t ticket = 0) {
  return {.change = {.kind = pipeline::StageChange::Kind::kSet,
                     .index = parameter_index(style::style_type(), "alpha"),
                     .type = &style::style_type(),
                     .value = alpha},
          .stream = stream,
          .ticket = ticket};
}

inline pipeline::Command model_command(std::uint32_t stream, const StageType& type,
                                       const StageModel* model, std::uint64_t ticket = 0) {
  return {.change = {.kind = pipeline::StageChange::Kind::kModel, .type = &type},
          .stream = stream,
          .ticket = ticket,
          .model = model};
}

inline pipeline::Command play_command(std::uint32_t stream, const gesture::PlayOrder& order,
                                      std::uint64_t ticket = 0) {
  return {.change = {.kind = pipeline::StageChange::Kind::kCommand,
                     .index = generate::GenerateStage::kPlay,
                     .type = &generate::generate_type()},
          .stream = stream,
          .ticket = ticket,
          .command = StageCommand::of(order)};
}

inline pipeline::Command stop_playing_command(std::uint32_t stream, std::uint64_t ticket = 0) {
  return {.change = {.kind = pipeline::StageChange::Kind::kCommand,
                     .index = generate::GenerateStage::kStopPlaying,
                     .type = &generate::generate_type()},
          .stream = stream,
          .ticket = ticket};
}

// A style stage with default options.
inline pipeline::EngineStage style_stage(const style::BoundModel* model) {
  return {&style::style_type(),
          std::make_unique<style::StyleFilter>(model, style::FilterOptions{})};
}

inline bool is_change(const pipeline::Decision& decision, const StageType& type,
                      pipeline::StageChange::Kind kind) {
  return decision.kind == pipeline::Decision::Kind::kChange && decision.change.type == &type &&
         decision.change.kind == kind;
}

}  // namespace posed::test
