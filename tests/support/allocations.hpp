// Counts the heap allocations of this thread: operator new, malloc, calloc, realloc and the like.
#pragma once

#include <cstdint>

namespace posed::test {

[[nodiscard]] std::uint64_t allocations() noexcept;

}  // namespace posed::test
