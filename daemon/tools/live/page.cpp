#include "daemon/tools/live/page.hpp"

#include <array>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace posed::tools {
namespace {

namespace fs = std::filesystem;

bool has_page(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "index.html", error);
}

bool has_screen() {
  const auto is_set = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return (is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) && isatty(STDERR_FILENO) == 1;
}

}  // namespace

Result<fs::path> find_page(const fs::path& named) {
  if (!named.empty()) return named;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/posed/viewer";
  for (const fs::path& folder : {installed, fs::path(POSED_VIEWER_DIR)}) {
    if (has_page(folder)) return folder;
  }
  return fail(
      "the page is not built; `./run page` builds it, and `posed top` shows the streams in"
      " the terminal");
}

void open_browser(const std::string& url) {
  if (!has_screen()) return;
  std::string program = "xdg-open";
  std::string address = url;
  const std::array<char*, 3> arguments{program.data(), address.data(), nullptr};
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&quiet, descriptor, "/dev/null", O_RDWR, 0);
  }
  // A browser lives longer than posed: in a session of its own, with signals as they usually are.
  posix_spawnattr_t usual;
  posix_spawnattr_init(&usual);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&usual, &none);
  posix_spawnattr_setsigdefault(&usual, &all);
  posix_spawnattr_setflags(&usual, static_cast<short>(POSIX_SPAWN_SETSIGMASK |
                                                      POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID));
  pid_t process = -1;
  // Without xdg-open the user opens the address that is printed.
  const bool started =
      posix_spawnp(&process, program.c_str(), &quiet, &usual, arguments.data(), environ) == 0;
  posix_spawnattr_destroy(&usual);
  posix_spawn_file_actions_destroy(&quiet);
  // It ends when the browser has got its orders, or with the browser.
  if (started) std::thread([process] { waitpid(process, nullptr, 0); }).detach();
}

}  // namespace posed::tools
