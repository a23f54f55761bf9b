// Asks the operating system for the rights that threads need which must wake on time. A refusal is
// no error. Cold.
#pragma once

#include <string>

namespace posed::system {

// Priorities under SCHED_FIFO: a thread closer to the device has a higher one.
inline constexpr int kDevicePriority = 13;  // an emulated one keeps time as a real one does
inline constexpr int kReaderPriority = 12;
inline constexpr int kPipelinePriority = 11;
inline constexpr int kPublisherPriority = 10;

// Locks the process's memory in RAM and tests whether threads may use SCHED_FIFO. Warns once if
// either is refused. Returns whether SCHED_FIFO is allowed.
[[nodiscard]] bool ask_for_realtime();

// Names the calling thread; only the first 15 letters are kept.
void name_thread(const std::string& name);

// The calling thread works from now on only with what the others leave (nice 19).
void give_way();

// Names the calling thread and makes its timers exact; with `priority` > 0 the thread also becomes
// SCHED_FIFO.
void enter_hot_thread(const char* name, int priority);

}  // namespace posed::system
