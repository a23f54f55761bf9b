// What `posed eval gesture` measures: how smooth a performance is and how near it comes to
// recordings, beside what needs no model. Shares its words with `--json`. Cold.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/trajectory/state_information.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// Frames, jerk, ldlj, sparc and the jerk of each group.
[[nodiscard]] nlohmann::json smoothness(const gesture::Vocabulary& vocabulary,
                                        const gesture::Recording& motion);

// The same of a reference, and how far the performance is from it. Returns an error for a reference
// of fewer than four frames.
[[nodiscard]] Result<nlohmann::json> against(const gesture::Vocabulary& vocabulary,
                                             const gesture::Recording& performed,
                                             const gesture::Recording& reference);

// How far the model's held poses are from those of a labelled reference [deg], for each label and
// group, where the model performs the reference's own labels. Beside them, where `recorded` is not
// empty, what these recordings give without a model: their nearest pose, their mean pose, and the
// best that can be composed of their groups. Returns an error where the model knows none of the
// labels.
[[nodiscard]] Result<nlohmann::json> hold_errors(const trajectory::StateInformation& information,
                                                 const gesture::Recording& reference,
                                                 const std::vector<gesture::Recording>& recorded);

// The recordings' frames, one below the other [frame][channel]; at least one recording.
[[nodiscard]] gesture::FeatureMatrix all_poses(const std::vector<gesture::Recording>& recordings);

}  // namespace posed::tools
