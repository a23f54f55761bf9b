// The settings by which a stream's engine runs. The live daemon fills them from the config, replay
// from the device log; engine_options() makes the same engine from them for both.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/system/stale.hpp"
#include "models/stage_type.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::pipeline {

// A stream that a stage has as a partner.
struct PartnerStream {
  std::uint32_t stream = kNoStream;  // its id; kNoStream: none is named, or it is not there
  StagePartner about{};
};
using PartnerStreams = std::map<std::string, PartnerStream>;  // by name

struct StageSettings {
  const StageType* type = nullptr;
  Parameters parameters{};  // complete
  // [StageType::partners]; empty before find_partners().
  std::vector<PartnerStream> partners{};
  // The model with which the stage starts.
  std::string model_sha256{};              // of its file, which the log keeps; empty: no model
  std::string model_name{};                // for people
  std::vector<std::string> model_words{};  // StageModel::words; empty in replay
};

struct StreamSettings {
  bool publish_raw = false;
  double stale_after_s = system::kStaleAfter_s;
  double rate_hz = 0.0;                 // the device's nominal rate; 0: unknown
  std::vector<StageSettings> stages{};  // in the order in which they run
};

// The stage's settings with every default. For tests and tools; `changed` must fit the table.
[[nodiscard]] StageSettings stage_settings(const StageType& type, const Parameters& changed = {});

// The streams that a stage names as its partners: [StageType::partners], empty for none. Cold.
[[nodiscard]] std::vector<std::string> partner_names(const StageType& type,
                                                     const Parameters& parameters);
// Finds the streams that the stages name among those that are there now, `known`. A stage runs
// without a partner that is not there. Fails if one has no poses. Cold.
Result<> find_partners(StreamSettings& settings, const PartnerStreams& known);

// A stage's view of the stream. `source` is the skeleton of the source's frames: the stages before
// this one may change it. The error says which of them cannot serve it. Cold.
Result<StageContext> stage_context(const StreamSettings& settings, std::size_t stage,
                                   const std::shared_ptr<const Skeleton>& source);

// The skeleton of the frames that leave the last stage; null for a stream that has samples only.
// Cold.
Result<std::shared_ptr<const Skeleton>> published_skeleton(
    const StreamSettings& settings, const std::shared_ptr<const Skeleton>& source);

// The options of the engine of stream number `stream`, with its stages. `models` has one entry for
// each stage, null where it starts without one; they outlive the engine or are replaced. `skeleton`
// is null for a stream that has samples only. The error says which stage cannot serve the stream.
// Cold.
Result<EngineOptions> engine_options(std::uint32_t stream, const StreamSettings& settings,
                                     const std::shared_ptr<const Skeleton>& skeleton,
                                     std::span<const StageModel* const> models);

}  // namespace posed::pipeline
