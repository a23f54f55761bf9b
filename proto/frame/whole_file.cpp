#include "proto/frame/whole_file.hpp"

#include <unistd.h>

#include <fstream>
#include <string>
#include <system_error>

namespace posed {
namespace {

std::filesystem::path target_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  auto target = std::filesystem::weakly_canonical(path, error);
  return error ? path : target;
}

}  // namespace

HeldSignals::HeldSignals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, signal);
  pthread_sigmask(SIG_BLOCK, &set, &before_);
}

HeldSignals::~HeldSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

Result<> write_whole_file(const std::filesystem::path& path,
                          const std::function<void(std::ostream&)>& write) {
  const HeldSignals held;
  const std::filesystem::path target = target_of(path);
  const std::filesystem::path part = target.string() + "." + std::to_string(::getpid()) + ".part";
  std::ofstream file(part, std::ios::binary | std::ios::trunc);
  if (!file) return fail("cannot be written: " + errno_text(), path.string());
  write(file);
  file.close();
  std::error_code error;
  if (!file) {
    const std::string why = errno_text();
    std::filesystem::remove(part, error);
    return fail("could not be written to its end: " + why, path.string());
  }
  std::filesystem::rename(part, target, error);
  if (!error) return {};
  const std::string why = error.message();
  std::filesystem::remove(part, error);
  return fail("cannot be written: " + why, path.string());
}

Result<> write_whole_file(const std::filesystem::path& path, std::string_view text) {
  return write_whole_file(path, [&](std::ostream& out) { out << text; });
}

}  // namespace posed
