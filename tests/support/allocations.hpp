// Counts what this thread takes from the heap: operator new, malloc and their kin.
#pragma once

#include <cstdint>

namespace posed::test {

[[nodiscard]] std::uint64_t allocations() noexcept;

}  // namespace posed::test
