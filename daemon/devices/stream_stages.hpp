// The stages of a stream: which ones it has by its config, their models, and its engine. All cold;
// errors do not name the stream.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
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
  // Stages whose model control has set. Live texts that only another model knows, such as weights
  // of its styles, then stand for their defaults.
  std::set<const StageType*> with_set_model;
  std::string remark;  // a sentence about this skeleton, for people; may be empty
};

class KeptSettings;

// Chooses the stages and reads their model files. `rate_hz` is the stream's nominal rate, 0 when
// unknown; `partners` are the streams that stages may name and that are there; `kept` replaces what
// the config says, null: nothing.
Result<LoadedStages> load_stages(const config::StreamConfig& config,
                                 std::shared_ptr<const Skeleton> skeleton, double rate_hz,
                                 ModelFiles& files, const pipeline::PartnerStreams& partners,
                                 const KeptSettings* kept = nullptr);
// The stages that a stream of this config may have, before its skeleton is known: those that only
// some skeletons have are among them.
[[nodiscard]] pipeline::StreamSettings possible_settings(const config::StreamConfig& config);

// Live texts that the model does not take get their defaults; null: those that need a model.
void forget_texts(const StageModel* model, pipeline::StageSettings& settings);

// The streams that the stages of the config name as partners.
[[nodiscard]] std::set<std::string> partners_of(const config::StreamConfig& config);
// The order in which to build the streams: each after those that its stages name.
[[nodiscard]] std::vector<std::size_t> building_order(
    const std::vector<const config::StreamConfig*>& streams);

// What the stages of a stream start with.
struct BoundStages {
  // One for each stage, bound to the stream's skeleton and rate; null for a stage without a model.
  std::vector<std::shared_ptr<const StageModel>> models;
  // What the stages do from the start on; without stream and ticket.
  std::vector<pipeline::Command> first_commands;

  [[nodiscard]] std::vector<const StageModel*> borrowed() const;
};
// Checks and binds the models, and fills in the words that they know.
Result<BoundStages> bind_stages(LoadedStages& stages, ModelFiles& files);

// The engine of the stream with this id, untimed. `bound` outlives it.
Result<pipeline::EngineOptions> make_engine(std::uint32_t stream, const LoadedStages& stages,
                                            const BoundStages& bound);

}  // namespace posed::devices
