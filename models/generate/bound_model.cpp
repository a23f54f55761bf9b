#include "models/generate/bound_model.hpp"

#include <utility>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::generate {
namespace {

// Look-ahead into the label sequence: with 20 frames at 30 Hz the jerk of a streamed trajectory is
// within 3 % of the full solution's (models/trajectory/README.md, "Look-ahead").
constexpr double kLookAhead_s = 20.0 / 30.0;

}  // namespace

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
  auto bound = std::make_unique<BoundModel>(
      trajectory::StateInformation(std::move(shared), stream_rate_hz(rate_hz)), std::move(*live),
      std::move(name));
  bound->player = std::make_unique<perform::LabelSequencePlayer>(
      bound->information,
      perform::PlayerOptions{.look_ahead_s = kLookAhead_s, .capacity = kMostWaiting + 4});
  return bound;
}

}  // namespace posed::generate
