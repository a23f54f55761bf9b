// The stages of a stream: which ones it has by its config, their models, and its engine. The same
// for the stream of a one-body device and for a body of a source. All cold; errors do not name the
// stream.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/devices/model_files.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "models/stage_type.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::devices {

struct LoadedStages {
  std::shared_ptr<const Skeleton> skeleton;   // of the frames that enter; null: samples only
  std::shared_ptr<const Skeleton> published;  // of the frames that leave the last stage
  // For the engine; without the hashes of the models, which only the recorder knows.
  pipeline::StreamSettings settings;
  std::vector<ModelBytes> model_files;  // the bytes of each stage's model file; null without one
};

// Chooses the stages and reads their model files. `rate_hz` is the stream's nominal rate, 0 when
// unknown; `partners` are the streams that stages may name.
[[nodiscard]] Result<LoadedStages> load_stages(const config::StreamConfig& config,
                                               std::shared_ptr<const Skeleton> skeleton,
                                               double rate_hz, ModelFiles& files,
                                               const pipeline::PartnerStreams& partners);

// What the stages of a stream start with.
struct BoundStages {
  // One for each stage, bound to the stream's skeleton and rate; null for a stage without a model.
  std::vector<std::unique_ptr<const StageModel>> models;
  // What the stages do from the start on; without stream and ticket.
  std::vector<pipeline::Command> first_commands;

  [[nodiscard]] std::vector<const StageModel*> borrowed() const;
};
// Checks and binds the models, and fills in the words that they know.
[[nodiscard]] Result<BoundStages> bind_stages(LoadedStages& stages);

// The engine of the stream with this id, untimed. `bound` outlives it.
[[nodiscard]] Result<pipeline::EngineOptions> make_engine(std::uint32_t stream,
                                                          const LoadedStages& stages,
                                                          const BoundStages& bound);

}  // namespace posed::devices
