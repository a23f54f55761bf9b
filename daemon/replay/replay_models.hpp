// ReplayModels: the models that a log's streams and decisions name, each read once before the
// replay starts. Each swap gets a newly bound model, as in the live run, because a model may carry
// state from its use. Cold.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "drivers/driver.hpp"
#include "models/generate/bound_model.hpp"
#include "models/style/style_filter.hpp"
#include "models/style/style_model.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::replay {

class ReplayModels {
 public:
  // The reader outlives it.
  explicit ReplayModels(const log::Reader& reader) : reader_(reader) {}

  // Binds the model to the device's skeleton, which must be present. Errors name the model. If
  // binding has succeeded once it succeeds again.
  [[nodiscard]] Result<std::unique_ptr<const style::BoundModel>> style(
      const std::string& hash, const drivers::Description& device,
      const style::FilterOptions& options);
  [[nodiscard]] Result<std::unique_ptr<const generate::BoundModel>> gesture(
      const std::string& hash, const drivers::Description& device);

 private:
  const log::Reader& reader_;
  std::map<std::string, style::StyleModel> styles_;
  std::map<std::string, gesture::GestureModel> gestures_;
};

}  // namespace posed::replay
