// The real `posed` against the lab's gloves: all stream together, then each is unplugged and
// plugged in again while the others go on.
#pragma once

#include "tests/lab/devices.hpp"

namespace posed::lab {

// Prints a line a glove; the number of them that failed.
int check_daemon(const LabDevices& devices);

}  // namespace posed::lab
