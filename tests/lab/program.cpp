#include "tests/support/shared.hpp"

namespace posed::test {

// Where the virtual machine keeps it (boot.sh).
std::filesystem::path posed_binary() { return "/bin/posed"; }

}  // namespace posed::test
