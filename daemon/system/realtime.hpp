// What the operating system can do for threads that must wake on time. Cold; refusal is no error.
#pragma once

#include <string>

namespace posed::system {

// Priorities under SCHED_FIFO: nearer to the device is more urgent.
inline constexpr int kReaderPriority = 12;
inline constexpr int kPipelinePriority = 11;
inline constexpr int kPublisherPriority = 10;

// Keeps the process's memory in RAM, and asks whether threads may be SCHED_FIFO. Warns, once, when
// either is refused; returns the answer to the second.
[[nodiscard]] bool ask_for_realtime();

// Names the calling thread: at most 15 letters are kept.
void name_thread(const std::string& name);

// Names the calling thread and makes its timers exact; with `priority` > 0 it becomes SCHED_FIFO.
void enter_hot_thread(const char* name, int priority);

}  // namespace posed::system
