// `posed calibrate` from the first pose to poses that a calibration can rest on.
#pragma once

#include <string>

#include "daemon/cli/devices/calibrate_poses.hpp"

namespace posed::cli {

// Leads `user` through the poses and says on stderr how good they are. On a terminal those that
// failed are asked for again, until the user gives up; elsewhere they are an error that names each
// and what was wrong. `force` takes them all the same, with a warning.
[[nodiscard]] Result<drivers::glove::Recorded> good_poses(GloveSource& source, const PosePlan& plan,
                                                          const std::string& user, bool force);

}  // namespace posed::cli
