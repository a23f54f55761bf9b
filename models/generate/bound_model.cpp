#include "models/generate/bound_model.hpp"

#include <utility>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::generate {
Result<std::unique_ptr<const BoundModel>> bind_model(gesture::GestureModel model,
                                                     const Skeleton& skeleton, double rate_hz,
                                                     std::string name) {
  if (!hand_side(skeleton)) {
    return fail("a gesture model needs a stream of hands (hand45), not " + in_quotes(skeleton.name),
                std::move(name));
  }
  auto live = smooth::bind_live_model(model, skeleton, name);
  if (!live) return std::unexpected(live.error());
  auto shared = std::make_shared<const gesture::GestureModel>(std::move(model));
  return std::make_unique<const BoundModel>(
      trajectory::StateInformation(std::move(shared), stream_rate_hz(rate_hz)), std::move(*live),
      std::move(name));
}

}  // namespace posed::generate
