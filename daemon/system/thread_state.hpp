// The state of one of this process's threads, as the kernel reports it. Cold.
#pragma once

#include <string>

namespace posed::system {

// Whether the kernel lets the thread of this name wait uninterruptibly (state D), as it does for a
// disk that does not answer. Only the first 15 letters of the name count (name_thread()); false if
// there is no such thread.
[[nodiscard]] bool waits_for_disk(const std::string& thread);

}  // namespace posed::system
