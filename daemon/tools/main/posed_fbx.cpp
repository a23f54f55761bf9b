// posed-fbx: the process in which an FBX file is read, by proto/clip/fbx.cpp. It reads the file
// from standard input and writes a .glb to standard output, or one sentence there, and ends with 1.
#include <unistd.h>

#include <cerrno>
#include <expected>
#include <new>
#include <string>
#include <string_view>

#include "proto/fbx/glb_of_fbx.hpp"

namespace {

std::string all_input() {
  std::string bytes;
  std::size_t used = 0;
  for (;;) {
    if (bytes.size() - used < 65'536) bytes.resize(2 * bytes.size() + 65'536);
    const ssize_t got = ::read(STDIN_FILENO, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    used += static_cast<std::size_t>(got);
  }
  bytes.resize(used);
  return bytes;
}

// False where nobody listens any more.
bool write_all(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

int main() {
  try {
    const std::string file = all_input();
    const auto confined = posed::fbx::confine(file.size());
    const auto glb = confined ? posed::fbx::glb_of_fbx(file) : std::unexpected(confined.error());
    const bool written = write_all(glb ? *glb : glb.error().message);
    ::_exit(glb && written ? 0 : 1);
  } catch (const std::bad_alloc&) {
    write_all(
        "needs more memory than a file of its length may take; export the figure without its "
        "meshes");
    ::_exit(1);
  }
}
