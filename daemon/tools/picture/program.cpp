#include "daemon/tools/picture/program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "proto/text/clean.hpp"

namespace posed::picture {
namespace {

// The end of what the program wrote on its stderr, in one line.
std::string last_words(int descriptor) {
  constexpr std::size_t kKept = 400;
  std::string text;
  char part[4096];
  for (ssize_t count = 0; (count = ::read(descriptor, part, sizeof(part))) != 0;) {
    if (count < 0 && errno != EINTR) break;
    if (count > 0) text.append(part, static_cast<std::size_t>(count));
    if (text.size() > kKept) text.erase(0, text.size() - kKept);
  }
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t line = text.rfind('\n');
  return clean(line == std::string::npos ? text : text.substr(line + 1));
}

}  // namespace

Result<> run_program(const std::vector<std::string>& arguments, const std::string& package) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int said[2];
  if (::pipe2(said, O_CLOEXEC) != 0) return fail("cannot make a pipe: " + errno_text());
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, said[1], 2);
  pid_t child = -1;
  const int failed = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(said[1]);
  const std::string words = failed == 0 ? last_words(said[0]) : std::string();
  ::close(said[0]);
  if (failed == ENOENT) {
    return fail("needs the program " + arguments.front() +
                ", which is not installed: apt install " + package);
  }
  if (failed != 0) return fail("cannot start " + arguments.front() + ": " + errno_text(failed));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) return fail("interrupted");
  return fail(arguments.front() + " failed" + (words.empty() ? "" : ": " + words));
}

}  // namespace posed::picture
