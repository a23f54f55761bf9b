#include "daemon/tools/bench/child_process.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace posed::tools {
namespace {

constexpr int kLastPriority = 19;

// A child has the descriptors of the children before it. If it kept the pipes to them, they would
// never read an end of file.
void close_all_but(const PipePair& pipes) {
  const int low = std::min(pipes.from(), pipes.to());
  const int high = std::max(pipes.from(), pipes.to());
  if (low > 3) close_range(3, static_cast<unsigned>(low - 1), 0);
  if (high > low + 1)
    close_range(static_cast<unsigned>(low + 1), static_cast<unsigned>(high - 1), 0);
  close_range(static_cast<unsigned>(high + 1), ~0U, 0);
}

}  // namespace

PipePair::~PipePair() {
  close_to();
  if (from_ >= 0) close(from_);
}

void PipePair::close_to() {
  if (to_ >= 0) close(to_);
  to_ = -1;
}

std::string PipePair::read_line() const {
  std::string line;
  for (char c = 0; ::read(from_, &c, 1) == 1 && c != '\n';) line.push_back(c);
  return line;
}

bool PipePair::write(const void* data, std::size_t size) const {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = ::write(to_, bytes, size);
    if (written <= 0) return false;
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool PipePair::read(void* data, std::size_t size) const {
  auto* bytes = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t count = ::read(from_, bytes, size);
    if (count <= 0) return false;
    bytes += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

Result<ChildProcess> ChildProcess::fork(const std::function<int(PipePair& parent)>& run,
                                        bool gives_way) {
  std::array<int, 2> down{};
  std::array<int, 2> up{};
  if (pipe2(down.data(), O_CLOEXEC) != 0) return fail("cannot make a pipe: " + errno_text());
  if (pipe2(up.data(), O_CLOEXEC) != 0) {
    const std::string cause = errno_text();
    for (const int end : down) close(end);
    return fail("cannot make a pipe: " + cause);
  }
  PipePair parents(up[0], down[1]);
  PipePair childs(down[0], up[1]);
  const int process = ::fork();
  if (process < 0) return fail("cannot fork: " + errno_text());
  if (process == 0) {
    close_all_but(childs);
    if (gives_way) static_cast<void>(setpriority(PRIO_PROCESS, 0, kLastPriority));
    _exit(run(childs));
  }
  return ChildProcess(process, std::move(parents));
}

ChildProcess::~ChildProcess() {
  if (process_ < 0) return;
  pipes_.close_to();
  waitpid(process_, nullptr, 0);
}

}  // namespace posed::tools
