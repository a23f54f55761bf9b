// The files of a device log: what stands behind its name. SQLite keeps the rest beside it while the
// log is open, or after a crash.
#pragma once

#include <array>

namespace posed::log {

inline constexpr std::array kFileSuffixes{"", "-wal", "-shm", "-journal"};

}  // namespace posed::log
