// A glove on ttyACM that hangs: Linux would keep closing its port for 30 s.
#pragma once

#include "tests/lab/devices.hpp"

namespace posed::lab {

// Starts `posed run` with a glove that takes no bytes and stops it by SIGTERM and by SIGKILL;
// prints a line for each and returns the number of those that failed.
int check_hang(const LabDevices& devices);

}  // namespace posed::lab
