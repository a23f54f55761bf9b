// The files that make up a device log. SQLite keeps further files beside the log while it is open,
// or after a crash.
#pragma once

#include <array>

namespace posed::log {

inline constexpr std::array kFileSuffixes{"", "-wal", "-shm", "-journal"};

}  // namespace posed::log
