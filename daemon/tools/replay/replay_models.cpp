#include "daemon/tools/replay/replay_models.hpp"

#include <utility>

namespace posed::replay {

Result<std::unique_ptr<const StageModel>> ReplayModels::bind(const std::string& hash,
                                                             const StageType& type,
                                                             const StageContext& context) {
  auto found = files_.find(hash);
  if (found == files_.end()) {
    auto bytes = TRY(reader_.blob(hash));
    found = files_.emplace(hash, std::move(bytes)).first;
  }
  return type.bind_model(found->second, context, "the log's model " + hash.substr(0, 12));
}

}  // namespace posed::replay
