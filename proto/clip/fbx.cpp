#include "proto/clip/fbx.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "proto/clip/draft.hpp"
#include "proto/clip/gltf.hpp"

namespace posed::clip {
namespace {

namespace fs = std::filesystem;

constexpr timeval kMaxWait{.tv_sec = 120, .tv_usec = 0};
constexpr std::size_t kMaxGlb = 2'000'000'000;  // bytes

// Beside this program in a build folder, otherwise where `cmake --install` puts it.
Result<fs::path> find_reader() {
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& path :
       {folder / "posed-fbx", folder.parent_path() / "libexec/posed/posed-fbx"}) {
    if (::access(path.c_str(), X_OK) == 0) return path;
  }
  return fail("is FBX, which needs the program posed-fbx beside posed; install posed again");
}

// The process that reads, and the socket that is its standard input and output.
class ReaderProcess {
 public:
  static Result<ReaderProcess> start();
  ReaderProcess(ReaderProcess&& other) noexcept
      : process_(std::exchange(other.process_, -1)), socket_(std::exchange(other.socket_, -1)) {}
  ReaderProcess& operator=(ReaderProcess&&) = delete;
  ~ReaderProcess() {
    if (socket_ >= 0) ::close(socket_);
    if (process_ < 0) return;
    ::kill(process_, SIGKILL);
    static_cast<void>(wait());
  }

  // Hands over the file and returns what came back, as long as the process was ready to talk.
  std::string exchange(std::string_view bytes) const;
  // Waits for the end of the process, which has closed its side or is to be ended.
  int end() {
    ::kill(process_, SIGKILL);  // no effect on one that has ended
    return wait();
  }

 private:
  ReaderProcess(pid_t process, int socket) : process_(process), socket_(socket) {}
  int wait() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return status;
  }

  pid_t process_;
  int socket_;
};

Result<ReaderProcess> ReaderProcess::start() {
  const auto program = TRY(find_reader());
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return fail("cannot be read: " + errno_text());
  }
  for (const int option : {SO_RCVTIMEO, SO_SNDTIMEO}) {
    ::setsockopt(ends[0], SOL_SOCKET, option, &kMaxWait, sizeof kMaxWait);
  }
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t usual;
  posix_spawnattr_init(&usual);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&usual, &none);
  posix_spawnattr_setsigdefault(&usual, &all);
  posix_spawnattr_setflags(&usual, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::string name = program.string();
  const std::array<char*, 2> arguments{name.data(), nullptr};
  const std::array<char*, 1> environment{nullptr};
  pid_t process = -1;
  const int error =
      posix_spawn(&process, name.c_str(), &files, &usual, arguments.data(), environment.data());
  posix_spawnattr_destroy(&usual);
  posix_spawn_file_actions_destroy(&files);
  ::close(ends[1]);
  if (error == 0) return ReaderProcess(process, ends[0]);
  ::close(ends[0]);
  return fail("cannot be read, because " + name + " does not start: " + errno_text(error));
}

std::string ReaderProcess::exchange(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) break;  // it has ended early, and may have said why
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  ::shutdown(socket_, SHUT_WR);
  std::string answer;
  std::array<char, 65'536> part{};
  while (answer.size() < kMaxGlb) {
    const ssize_t got = ::recv(socket_, part.data(), part.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    answer.append(part.data(), static_cast<std::size_t>(got));
  }
  return answer;
}

Result<std::string> glb_of(const ClipFile& file) {
  auto reader = ReaderProcess::start();
  if (!reader) return fail(reader.error().message, file.name);
  std::string answer = reader->exchange(file.bytes);
  const int status = reader->end();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return answer;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 1 && !answer.empty()) {
    return fail(answer.substr(0, 500), file.name);
  }
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) {
    return fail("takes longer than a minute to read; export the figure without its meshes",
                file.name);
  }
  return fail("breaks the reader of FBX files, so it is damaged; export it again", file.name);
}

Result<Draft> read_fbx(const ClipFile& file, const ReadOptions& options) {
  auto glb = TRY(glb_of(file));
  return read_gltf({.name = file.name, .bytes = std::move(glb)}, options);
}

bool begins_fbx(std::string_view begin) {
  return begin.starts_with("Kaydara FBX Binary") || begin.starts_with("; FBX");
}

}  // namespace

Format fbx_format() {
  return {
      .name = "FBX",
      .extensions = {".fbx"},
      .article = "an",
      .options = {ReadOption::kUnit, ReadOption::kUp, ReadOption::kFacing, ReadOption::kProfile},
      .sniff = begins_fbx,
      .read = read_fbx};
}

}  // namespace posed::clip
