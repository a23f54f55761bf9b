// Runs inside the virtual machine that tests/lab/boot.sh starts; see tests/lab/README.md.
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/lab/daemon_check.hpp"
#include "tests/lab/hang_check.hpp"
#include "tests/lab/transports.hpp"

// posed_lab [ONLY]: all checks, those of one transport, of posed, or of a glove that hangs
// ("hang").
int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::string_view only = argc > 1 ? argv[1] : "";
  const auto devices = posed::lab::lab_devices();
  int failed = 0;
  if (only != "posed" && only != "hang") failed += posed::lab::check_transports(devices, only);
  if (only.empty() || only == "posed") failed += posed::lab::check_daemon(devices);
  if (only.empty() || only == "hang") failed += posed::lab::check_hang(devices);
  std::printf(failed == 0 ? "LAB PASSED\n" : "LAB FAILED: %d\n", failed);
  return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
