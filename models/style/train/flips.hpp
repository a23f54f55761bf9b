// Mends joints that flip: a marker system loses a thumb for a moment, and its joint turns about by
// up to half a turn between two frames and back. What nobody did must not be learnt. Cold.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "models/motion/pose_space.hpp"
#include "proto/frame/result.hpp"

namespace posed::style {

// Changes `q` [frames x dims, rad, of a space of rotation vectors] where a joint turns by more than
// 90 degrees between two frames: the shorter parts between such flips are filled in from the frames
// beside them. A joint that carries no other and stays flipped for more than half a second is left
// out, that is, it keeps its median. Returns a sentence for each joint that was mended; the error
// names one that carries others and stays flipped. The angles of cmu43 are only checked.
Result<std::vector<std::string>> mend_flips(const motion::PoseSpaceSpec& spec,
                                            const motion::PoseSpace& space, double rate_hz,
                                            Eigen::MatrixXd& q);

}  // namespace posed::style
