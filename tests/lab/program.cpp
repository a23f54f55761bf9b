#include "tests/support/shared.hpp"

namespace posed::test {

// Its path in the virtual machine (boot.sh).
std::filesystem::path posed_binary() { return "/bin/posed"; }

}  // namespace posed::test
