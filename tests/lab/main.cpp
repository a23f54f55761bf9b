// Runs inside the virtual machine that tests/lab/boot.sh starts; see tests/lab/README.md.
#include <cstdio>
#include <cstdlib>

#include "tests/lab/transports.hpp"

// posed_lab [ONLY]: all devices, or the one of that name.
int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const int failed = posed::lab::check_transports(argc > 1 ? argv[1] : "");
  std::printf(failed == 0 ? "LAB PASSED\n" : "LAB FAILED: %d\n", failed);
  return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
