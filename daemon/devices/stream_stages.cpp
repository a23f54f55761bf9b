#include "daemon/devices/stream_stages.hpp"

#include <algorithm>
#include <utility>

#include "daemon/devices/kept_settings.hpp"
#include "models/stage_type.hpp"
#include "models/stages/registry.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::devices {
namespace {

bool has_bridge(const config::StreamConfig& config) {
  return std::ranges::any_of(config.stages,
                             [](const config::StageConfig& stage) { return stage.type->bridges; });
}

// The stages that the config names, and those that a stream of this skeleton has by default.
// All stages are for people and hands, so a prop passes unchanged.
Result<std::vector<config::StageConfig>> stages_of(const config::StreamConfig& config,
                                                   const Skeleton* skeleton) {
  if (skeleton != nullptr && is_prop(*skeleton)) return std::vector<config::StageConfig>();
  if (!config.default_stages || skeleton == nullptr) return config.stages;
  std::vector<config::StageConfig> stages;
  for (const StageType* type : stage_types()) {
    const auto named = std::ranges::find(config.stages, type, &config::StageConfig::type);
    const bool off = std::ranges::find(config.off, type) != config.off.end();
    if (named != config.stages.end()) {
      stages.push_back(*named);
    } else if (!off && type->is_default != nullptr &&
               type->is_default(*skeleton, has_bridge(config))) {
      auto parameters = TRY(complete_parameters(type->parameters, {}));
      stages.push_back({.type = type, .parameters = std::move(parameters)});
    }
  }
  return stages;
}

// Puts the stream behind those that it names; a stream that has its place already stays there.
void place(std::size_t stream, const std::vector<const config::StreamConfig*>& streams,
           std::vector<bool>& placed, std::vector<std::size_t>& order) {
  if (placed[stream]) return;
  placed[stream] = true;
  const std::set<std::string> partners = partners_of(*streams[stream]);
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (partners.contains(streams[i]->name)) place(i, streams, placed, order);
  }
  order.push_back(stream);
}

}  // namespace

Result<LoadedStages> load_stages(const config::StreamConfig& config,
                                 std::shared_ptr<const Skeleton> skeleton, double rate_hz,
                                 ModelFiles& files, const pipeline::PartnerStreams& partners,
                                 const KeptSettings* kept) {
  LoadedStages loaded;
  loaded.settings = {
      .publish_raw = config.publish_raw, .stale_after_s = config.stale_after_s, .rate_hz = rate_hz};
  auto stages = TRY(stages_of(config, skeleton.get()));
  if (skeleton && is_prop(*skeleton) && !config.stages.empty()) {
    loaded.remark = "a rigid body; it passes unchanged, because its stages are for people";
  }
  loaded.skeleton = std::move(skeleton);
  for (config::StageConfig& stage : stages) {
    if (stage.type->read_files != nullptr) {
      TRY(stage.type->read_files(stage.parameters));
    }
    loaded.settings.stages.push_back({.type = stage.type,
                                      .parameters = std::move(stage.parameters),
                                      .model_name = stage.model.filename().string()});
    ModelBytes& file = loaded.model_files.emplace_back();
    if (stage.model.empty()) continue;
    file = TRY(files.load(stage.model));
  }
  if (kept != nullptr) kept->apply(config.name, loaded);
  TRY(pipeline::find_partners(loaded.settings, partners));
  auto published = TRY(pipeline::published_skeleton(loaded.settings, loaded.skeleton));
  loaded.published = std::move(published);
  return loaded;
}

pipeline::StreamSettings possible_settings(const config::StreamConfig& config) {
  pipeline::StreamSettings settings{.publish_raw = config.publish_raw,
                                    .stale_after_s = config.stale_after_s};
  const Skeleton hand = hand_skeleton(Side::kRight);  // only hands have stages by default
  for (const StageType* type : stage_types()) {
    const auto named = std::ranges::find(config.stages, type, &config::StageConfig::type);
    const bool off = std::ranges::find(config.off, type) != config.off.end();
    if (named != config.stages.end()) {
      settings.stages.push_back({.type = type, .parameters = named->parameters});
    } else if (config.default_stages && !off && type->is_default != nullptr &&
               type->is_default(hand, has_bridge(config))) {
      settings.stages.push_back(pipeline::stage_settings(*type));
    }
  }
  return settings;
}

void forget_texts(const StageModel* model, pipeline::StageSettings& settings) {
  for (const StageCommandType& command : settings.type->commands) {
    if (!is_live_text(*settings.type, command.name)) continue;
    auto& text = settings.parameters.at(std::string(command.name));
    const std::vector<std::string> words{std::get<std::string>(text)};
    if (!command.encode(model, words, {})) text = std::string();
  }
}

std::set<std::string> partners_of(const config::StreamConfig& config) {
  std::set<std::string> partners;
  for (const config::StageConfig& stage : config.stages) {
    for (const std::string& name : pipeline::partner_names(*stage.type, stage.parameters)) {
      if (!name.empty()) partners.insert(name);
    }
  }
  return partners;
}

std::vector<std::size_t> building_order(const std::vector<const config::StreamConfig*>& streams) {
  std::vector<std::size_t> order;
  std::vector<bool> placed(streams.size());
  for (std::size_t i = 0; i < streams.size(); ++i) place(i, streams, placed, order);
  return order;
}

std::vector<const StageModel*> BoundStages::borrowed() const {
  std::vector<const StageModel*> pointers(models.size());
  std::ranges::transform(models, pointers.begin(), [](const auto& model) { return model.get(); });
  return pointers;
}

Result<BoundStages> bind_stages(LoadedStages& stages, ModelFiles& files) {
  BoundStages bound;
  for (std::size_t i = 0; i < stages.settings.stages.size(); ++i) {
    pipeline::StageSettings& stage = stages.settings.stages[i];
    auto& model = bound.models.emplace_back();
    std::span<const std::byte> file;
    if (stages.skeleton && stages.model_files[i]) {
      file = std::as_bytes(std::span(*stages.model_files[i]));
      const auto context = TRY(pipeline::stage_context(stages.settings, i, stages.skeleton));
      model = TRY(files.bind(*stage.type, stages.model_files[i], context, stage.model_name));
      stage.model_words = model->words;
      if (stages.with_set_model.contains(stage.type)) forget_texts(model.get(), stage);
    }
    if (stage.type->first_command == nullptr) continue;
    const auto first = TRY(stage.type->first_command(stage.parameters, model.get(), file));
    if (!first) continue;
    bound.first_commands.push_back({.change = {.kind = pipeline::StageChange::Kind::kCommand,
                                               .index = static_cast<std::uint8_t>(first->index),
                                               .type = stage.type},
                                    .command = first->command});
  }
  return bound;
}

Result<pipeline::EngineOptions> make_engine(std::uint32_t stream, const LoadedStages& stages,
                                            const BoundStages& bound) {
  return pipeline::engine_options(stream, stages.settings, stages.skeleton, bound.borrowed());
}

}  // namespace posed::devices
