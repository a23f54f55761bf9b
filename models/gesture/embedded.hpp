// One round of alignment over whole recordings: the models of successive labels are chained and
// aligned with all frames that the labels cover, so that the labels' borders are only hints
// (models/gesture/README.md, "Embedded rounds"). Cold.
#pragma once

#include <functional>
#include <vector>

#include "models/gesture/estimate.hpp"
#include "models/gesture/recording.hpp"

namespace posed::gesture {

// Receives the first of the frames that one segment was aligned with, the state probabilities of
// each of them, and the expected stays.
using TakePart = std::function<void(std::size_t segment, Eigen::Index first_frame,
                                    const Eigen::MatrixXd& gamma, const Eigen::VectorXd& stays)>;

// `models` has one model per segment; a border moves by at most `slack` frames. Segments that do
// not touch are aligned separately. Returns the log likelihood of the whole recording.
double align_embedded(const FeatureMatrix& features, const std::vector<Segment>& segments,
                      const std::vector<const StateModel*>& models, int slack,
                      const TakePart& take);

}  // namespace posed::gesture
