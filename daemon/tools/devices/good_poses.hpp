// Records the poses for `posed calibrate` until they are good enough for a calibration.
#pragma once

#include <string>

#include "daemon/tools/devices/calibrate_poses.hpp"

namespace posed::tools {

// Leads the user through the poses with `user` and reports on stderr how good they are. On a
// terminal, poses that failed are asked for again until the user gives up; otherwise they are an
// error that names each one and its fault. `force` accepts them all the same, with a warning.
[[nodiscard]] Result<drivers::glove::Recorded> good_poses(GloveSource& source, const PosePlan& plan,
                                                          const std::string& user, bool force);

}  // namespace posed::tools
