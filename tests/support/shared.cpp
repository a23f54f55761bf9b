#include "tests/support/shared.hpp"

namespace posed::test {

// Only this file contains absolute paths, so that a compiler cache works across checkouts.
std::filesystem::path source_dir() { return POSED_SOURCE_DIR; }
std::filesystem::path posed_binary() { return POSED_BINARY; }

}  // namespace posed::test
