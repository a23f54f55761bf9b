// How well a walker fits a style model's training data: the distance of the clip's poses from the
// training poses, and the model's average change for them. Cold.
#pragma once

#include <string>

#include <Eigen/Core>

#include "models/style/model/style_model.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

struct WalkerFit {
  // Median over the clip's frames of the distance to the nearest pose of training: the rotation,
  // rms over joints.
  double distance_deg = 0.0;
  Eigen::VectorXd mean_change;  // the model's change of q at alpha 1, averaged over the clip [dims]

  // Far from the training poses the model only gives its average change. Measured on dataset 1 and
  // 2: other clips of the training's walkers are at 2.6 to 5.5 degrees, other styles of the same
  // actor at 9.6 to 15, other actors' walks at 12 to 20, other motions at 13 to 27
  // (models/style/README.md, "Verdicts").
  [[nodiscard]] bool is_far() const { return distance_deg > kFar_deg; }
  static constexpr double kFar_deg = 8.0;
};

// Returns the same errors as apply_to_clip(). `model_name` is for errors.
Result<WalkerFit> fit_of_walker(const StyleModel& model, const std::string& model_name,
                                const clip::Clip& clip);

// A copy of the model, of one style, that gives the same change for every pose, that is, a constant
// offset.
[[nodiscard]] StyleModel with_constant_change(StyleModel model, const Eigen::VectorXd& change);

}  // namespace posed::style
