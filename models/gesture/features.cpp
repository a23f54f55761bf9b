#include "models/gesture/features.hpp"

#include <algorithm>

namespace posed::gesture {

FeatureMatrix features_of(const FeatureMatrix& values) {
  const Eigen::Index frames = values.rows();
  const Eigen::Index channels = values.cols();
  FeatureMatrix features(frames, 3 * channels);
  for (Eigen::Index t = 0; t < frames; ++t) {
    const auto before = values.row(std::max<Eigen::Index>(t - 1, 0));
    const auto after = values.row(std::min(t + 1, frames - 1));
    features.row(t) << values.row(t), 0.5 * (after - before), after - 2.0 * values.row(t) + before;
  }
  return features;
}

}  // namespace posed::gesture
