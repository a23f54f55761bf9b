#include "tests/support/shared.hpp"

namespace posed::test {

// The paths are compiled into this file alone, so that a compiler cache serves every checkout.
std::filesystem::path source_dir() { return POSED_SOURCE_DIR; }
std::filesystem::path posed_binary() { return POSED_BINARY; }

}  // namespace posed::test
