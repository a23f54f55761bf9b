#include "daemon/devices/kept_settings.hpp"

#include <memory>
#include <string_view>

namespace posed::devices {

KeptSettings::KeptStage& KeptSettings::changed(const std::string& stream, const StageType& stage) {
  KeptStream& kept = streams_[stream];
  ++kept.changes;
  return kept.stages[&stage];
}

ModelBytes KeptSettings::shared(std::span<const std::byte> file) const {
  const std::string_view bytes(reinterpret_cast<const char*>(file.data()), file.size());
  for (const auto& [name, stream] : streams_) {
    for (const auto& [type, stage] : stream.stages) {
      if (stage.model && *stage.model == bytes) return stage.model;
    }
  }
  return std::make_shared<const std::string>(bytes);
}

void KeptSettings::set(const std::string& stream, const StageType& stage,
                       const std::string& parameter, ParameterValue value) {
  {
    const std::scoped_lock lock(mutex_);
    changed(stream, stage).parameters.insert_or_assign(parameter, std::move(value));
  }
  notify();
}

void KeptSettings::set_model(const std::string& stream, const StageType& stage,
                             std::span<const std::byte> file, std::string name) {
  {
    const std::scoped_lock lock(mutex_);
    ModelBytes bytes = file.empty() ? std::make_shared<const std::string>() : shared(file);
    KeptStage& kept = changed(stream, stage);
    kept.model = std::move(bytes);
    kept.model_name = std::move(name);
  }
  notify();
}

void KeptSettings::apply(const std::string& stream, LoadedStages& stages) const {
  const std::scoped_lock lock(mutex_);
  const auto kept = streams_.find(stream);
  if (kept == streams_.end()) return;
  for (std::size_t i = 0; i < stages.settings.stages.size(); ++i) {
    pipeline::StageSettings& settings = stages.settings.stages[i];
    const auto stage = kept->second.stages.find(settings.type);
    if (stage == kept->second.stages.end()) continue;
    for (const auto& [name, value] : stage->second.parameters) settings.parameters[name] = value;
    if (!stage->second.model) continue;
    const bool none = stage->second.model->empty();
    stages.model_files[i] = none ? nullptr : stage->second.model;
    stages.with_set_model.insert(settings.type);
    settings.model_name = stage->second.model_name;
    if (none) forget_texts(nullptr, settings);
  }
}

std::uint64_t KeptSettings::changes(const std::string& stream) const {
  const std::scoped_lock lock(mutex_);
  const auto kept = streams_.find(stream);
  return kept == streams_.end() ? 0 : kept->second.changes;
}

}  // namespace posed::devices
