#include "tests/lab/hang_check.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/lab/gadget.hpp"
#include "tests/support/process.hpp"

namespace posed::lab {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPatience = 60s;  // longer than the kernel's closing_wait
constexpr auto kMaxEnd = 500ms;
constexpr const char* kConfig = "/tmp/hang.toml";

// How many descriptors of the process are serial ports of USB modems.
std::ptrdiff_t open_ports(pid_t process) {
  std::filesystem::directory_iterator all("/proc/" + std::to_string(process) + "/fd");
  return std::ranges::count_if(all, [](const auto& fd) {
    std::error_code gone;
    return std::filesystem::read_symlink(fd.path(), gone).string().starts_with("/dev/ttyACM");
  });
}

bool comes_to(pid_t process, std::ptrdiff_t ports) {
  const auto deadline = Clock::now() + kPatience;
  while (open_ports(process) != ports) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(10ms);
  }
  return true;
}

// `closing`: it is stopped while its port closes, because the glove does not answer; otherwise
// while it asks the glove for its hand.
bool ends(LabDevice& glove, int signal, int wanted_code, bool closing, const char* what) {
  test::Process posed({"run", "--config", kConfig});
  if (!posed.line()) give_up("posed does not start: " + posed.errors());
  glove.plug_hung();
  const bool opened = comes_to(posed.pid(), 1);
  std::this_thread::sleep_for(500ms);  // it has written its question
  const bool ready = opened && (!closing || comes_to(posed.pid(), 0));
  const auto begin = Clock::now();
  posed.send(signal);
  const auto code = posed.exit_code(kPatience);
  const auto took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
  glove.unplug();
  const bool good = ready && code == wanted_code && took < kMaxEnd;
  std::printf("%s posed and a glove that takes no bytes: %s, ended with %d after %ld ms%s\n",
              good ? "ok  " : "FAIL", what, code.value_or(-1), static_cast<long>(took.count()),
              ready ? "" : "; posed has not opened it");
  if (!good) std::printf("posed says: %s\n", posed.errors().c_str());
  return good;
}

}  // namespace

int check_hang(const LabDevices& devices) {
  LabDevice& glove = **std::ranges::find(devices, "ttyacm", &LabDevice::name);
  std::ofstream(kConfig)
      << "realtime = false\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n"
         "[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
         "[[stream]]\nname = \"glove\"\ndriver = \"lucidgloves\"\nid = \"ACM-1\"\n";
  int failed = 0;
  failed += ends(glove, SIGTERM, 0, false, "SIGTERM while it is asked") ? 0 : 1;
  failed += ends(glove, SIGTERM, 0, true, "SIGTERM while its port closes") ? 0 : 1;
  failed += ends(glove, SIGKILL, 128 + SIGKILL, false, "SIGKILL") ? 0 : 1;
  return failed;
}

}  // namespace posed::lab
