// ReplayModels: the model files that a log's streams and decisions name, each read from the log
// once. Each swap gets a newly bound model, as in the live run, because a model may carry state
// from its use. Cold.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/stage_type.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::replay {

class ReplayModels {
 public:
  // The reader outlives it.
  explicit ReplayModels(const log::Reader& reader) : reader_(reader) {}

  // Binds the model stored under `hash` for a stage. Errors name the model. If binding has
  // succeeded once it succeeds again.
  Result<std::unique_ptr<const StageModel>> bind(const std::string& hash, const StageType& type,
                                                 const StageContext& context);

 private:
  const log::Reader& reader_;
  std::map<std::string, std::vector<std::byte>> files_;
};

}  // namespace posed::replay
