// One round over whole recordings: the models of the labels in a row against all frames of their
// stretch, so that a label's borders are only hints (models/gesture/README.md, "Embedded rounds").
// Cold.
#pragma once

#include <functional>
#include <vector>

#include "models/gesture/estimate.hpp"
#include "models/gesture/recording.hpp"

namespace posed::gesture {

// The part of an example that one segment was aligned with.
using TakePart = std::function<void(std::size_t segment, const Frames& frames,
                                    const Eigen::MatrixXd& gamma, const Eigen::VectorXd& stays)>;

// `models` has one model a segment; a border moves by at most `slack` frames. Segments that do not
// touch are aligned apart. The log likelihood of all of it.
double align_embedded(const FeatureMatrix& features, const std::vector<Segment>& segments,
                      const std::vector<const StateModel*>& models, int slack,
                      const TakePart& take);

}  // namespace posed::gesture
