// posed-mpi: `posed train` on the cores of many machines. All ranks run the same command; rank 0
// speaks for them.
#include <algorithm>
#include <csignal>
#include <exception>
#include <memory>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "daemon/tools/cli.hpp"
#include "daemon/tools/mpi/mpi_ranks.hpp"

namespace {

// A terminal shows what rank 0 prints, once. What another rank has to say is kept for rank 0.
class Silence {
 public:
  Silence() : kept_(memfd_create("stderr", MFD_CLOEXEC)) {
    dup2(kept_, STDERR_FILENO);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDOUT_FILENO);
    close(nowhere);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
  ~Silence() { close(kept_); }

  // The last line.
  [[nodiscard]] std::string words() const {
    constexpr std::size_t kEnough = 4096;
    std::string text(kEnough, '\0');
    const auto end = lseek(kept_, 0, SEEK_END);
    const auto from = std::max<off_t>(0, end - static_cast<off_t>(kEnough));
    text.resize(std::max<ssize_t>(0, pread(kept_, text.data(), kEnough, from)));
    while (text.ends_with('\n')) text.pop_back();
    return text.substr(text.rfind('\n') + 1);
  }

 private:
  int kept_;
};

// mpirun ends all ranks when one has died, and on Ctrl-C.
void ended_by_mpirun(int /*signal*/) {
  const auto say = [](std::string_view words) {
    static_cast<void>(::write(STDERR_FILENO, words.data(), words.size()));
  };
  say("posed-mpi: ended by mpirun, because a rank has died or somebody asked for it; ");
  say(posed::mpi::g_model_written != 0 ? "the model had been written before\n"
                                       : "no model was written\n");
  _exit(1);
}

// What a follower leaves with: what it printed last, or what it has thrown, which would otherwise
// end it without a word.
std::string follow(int argc, char** argv, const std::shared_ptr<posed::tools::Ranks>& ranks) {
  const Silence silence;
  try {
    static_cast<void>(posed::tools::train_main_of(argc, argv, ranks));
  } catch (const std::exception& error) {
    return error.what();
  }
  return silence.words();
}

}  // namespace

int main(int argc, char** argv) {
  posed::mpi::Link link;
  std::string command_line;
  for (int i = 1; i < argc; ++i) command_line += std::string(i > 1 ? " " : "") + argv[i];
  if (link.rank() != 0) {
    const auto ranks = std::make_shared<posed::mpi::Follower>(link, command_line);
    ranks->leave(follow(argc, argv, ranks));
    return 0;
  }
  if (link.size() > 1) std::signal(SIGTERM, ended_by_mpirun);
  const auto ranks = std::make_shared<posed::mpi::Leader>(link, command_line);
  const int exit_code = posed::tools::train_main_of(argc, argv, ranks);
  ranks->leave({});
  return exit_code;
}
