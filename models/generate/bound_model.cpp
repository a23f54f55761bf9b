#include "models/generate/bound_model.hpp"

#include <string>
#include <utility>
#include <vector>

namespace posed::generate {
namespace {

std::vector<std::string> label_names(const gesture::GestureModel& model) {
  std::vector<std::string> names;
  names.reserve(model.labels.size());
  for (const gesture::Label& label : model.labels) names.push_back(label.name);
  return names;
}

}  // namespace

BoundModel::BoundModel(trajectory::StateInformation states,
                       std::unique_ptr<const smooth::LiveModel> smoother, std::string file)
    : StageModel(std::move(file), label_names(states.model())),
      information(std::move(states)),
      live(std::move(smoother)) {}

Result<std::unique_ptr<const BoundModel>> bind_model(gesture::GestureModel model,
                                                     const Skeleton& skeleton, double rate_hz,
                                                     std::string name) {
  auto live = TRY(smooth::bind_live_model(model, skeleton, name));
  auto shared = std::make_shared<const gesture::GestureModel>(std::move(model));
  return std::make_unique<const BoundModel>(
      trajectory::StateInformation(std::move(shared), stream_rate_hz(rate_hz)), std::move(live),
      std::move(name));
}

}  // namespace posed::generate
