// ReplayModels: the models that a log's streams and decisions name, each read once, before anything
// is replayed. A swap gets a freshly bound one, as live: a model may carry state of its use. Cold.
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

  // Bound to the device's skeleton, which is there. Errors name the model. What has been bound once
  // can be bound again.
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
