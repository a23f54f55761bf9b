// Checks the real `posed` with the lab's gloves: all stream together, then each is unplugged and
// plugged in again while the others continue.
#pragma once

#include "tests/lab/devices.hpp"

namespace posed::lab {

// Prints one line per glove and returns the number of gloves that failed.
int check_daemon(const LabDevices& devices);

}  // namespace posed::lab
