// posed-mpi under mpirun: the same model file for any number of ranks, as `posed train` writes it;
// ranks that read different files, and a rank that dies. Skipped by name where the build found no
// Open MPI.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>

#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"
#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/support/pipe.hpp"
#include "tests/support/temp_folder.hpp"

#define SKIP_WITHOUT_MPI()                                                                \
  do {                                                                                    \
    WARN("SKIPPED without Open MPI: " << Catch::getResultCapture().getCurrentTestName()); \
    return;                                                                               \
  } while (false)

namespace posed::test {
namespace {

using motion::WalkerFamily;

std::filesystem::path posed_mpi() { return posed_binary().string() + "-mpi"; }

// `mpirun` with `ranks` processes of posed-mpi; CI is root, and has fewer cores than ranks.
std::vector<std::string> ranks_of(int ranks, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{"mpirun", "--allow-run-as-root", "--oversubscribe",
                                   "-n",     std::to_string(ranks), posed_mpi().string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

ProgramOutcome finished(Process& process) {
  const std::string out = process.rest();
  const auto code = process.exit_code();
  REQUIRE(code);
  return {*code, out, process.errors()};
}

ProgramOutcome run(std::vector<std::string> command) {
  Process process(Command{std::move(command)});
  return finished(process);
}

// The processes of posed-mpi that mpirun has started.
std::vector<pid_t> ranks_below(pid_t mpirun) {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    pid_t pid = 0;
    pid_t parent = 0;
    std::string name, state;
    if (stat >> pid >> name >> state >> parent && parent == mpirun && name == "(posed-mpi)") {
      found.push_back(pid);
    }
  }
  return found;
}

// The one of two ranks that does not lead, whose stdout goes nowhere.
pid_t follower_of(pid_t mpirun) {
  for (const pid_t rank : ranks_below(mpirun)) {
    std::error_code ignored;
    const auto out =
        std::filesystem::read_symlink("/proc/" + std::to_string(rank) + "/fd/1", ignored);
    if (out == "/dev/null") return rank;
  }
  FAIL("no rank follows");
  return 0;
}

// Whether it still computes; nobody may have asked yet how it ended.
bool runs(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string word, state;
  return stat >> word >> word >> state && state != "Z" && state != "X";
}

// Walkers of two people in two styles.
struct MpiStudio {
  TempFolder folder;

  explicit MpiStudio(double seconds = 4.0) {
    for (const std::uint32_t person : {1U, 2U}) {
      write("march_" + std::to_string(person), {WalkerFamily::kMarch, person, seconds});
      write("sway_" + std::to_string(person), {WalkerFamily::kSway, person, seconds});
    }
  }
  void write(const std::string& name, const motion::WalkerOptions& options) const {
    const auto clip = motion::make_walker(options);
    REQUIRE(clip::write_bvh(*clip, path(name + ".bvh")));
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }
  [[nodiscard]] std::vector<std::string> train(const std::string& out) const {
    return {"train",
            "style",
            "--from",
            "a:" + path("march_1.bvh"),
            "b:" + path("march_2.bvh"),
            "--to",
            "a:" + path("sway_1.bvh"),
            "b:" + path("sway_2.bvh"),
            "--force",
            "--out",
            path(out)};
  }
  [[nodiscard]] bool nothing_written(const std::string& name) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      if (entry.path().filename().string().starts_with(name)) return false;
    }
    return true;
  }
};

// A training that takes long enough to be disturbed, once it has begun.
struct LongTraining {
  MpiStudio studio{120.0};  // about ten seconds of work
  Process mpirun;

  LongTraining() : mpirun(Command{ranks_of(2, with_paper())}) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!has(mpirun.errors(), "reading clips") && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    REQUIRE(has(mpirun.errors(), "reading clips"));
    REQUIRE_FALSE(has(mpirun.errors(), "written"));
  }
  [[nodiscard]] std::vector<std::string> with_paper() const {
    auto arguments = studio.train("long.style");
    arguments.insert(arguments.end(), {"--mode", "paper"});
    return arguments;
  }
};

}  // namespace

TEST_CASE("any number of ranks writes the model file of posed train", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  const MpiStudio studio;
  REQUIRE(posed(studio.train("alone.style")).code == 0);
  const std::string alone = file_text(studio.path("alone.style"));
  for (const int ranks : {1, 2, 4}) {
    const auto done = run(ranks_of(ranks, studio.train("mpi.style")));
    INFO(ranks << " ranks: " << done.err);
    REQUIRE(done.code == 0);
    CHECK(file_text(studio.path("mpi.style")) == alone);
    // Only one of them speaks.
    const auto spoken = done.out.find("written after");
    CHECK(spoken != std::string::npos);
    CHECK(spoken == done.out.rfind("written after"));
    std::filesystem::remove(studio.path("mpi.style"));
  }
}

TEST_CASE("ranks train gestures to the file of posed train", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  const MpiStudio studio;
  const auto signer = gesture::make_performance({.gestures = 30});
  REQUIRE(clip::write_hand_csv(signer->clip, studio.path("take.csv")));
  REQUIRE(clip::write_labels(signer->labels, studio.path("take.lab")));
  const auto train = [&](const std::string& out) {
    return std::vector<std::string>{"train",
                                    "gesture",
                                    "--clip",
                                    studio.path("take.csv"),
                                    "--labels",
                                    studio.path("take.lab"),
                                    "--embedded-rounds",
                                    "1",
                                    "--out",
                                    studio.path(out)};
  };
  REQUIRE(posed(train("alone.gesture")).code == 0);
  const auto done = run(ranks_of(3, train("mpi.gesture")));
  INFO(done.err);
  REQUIRE(done.code == 0);
  CHECK(file_text(studio.path("mpi.gesture")) == file_text(studio.path("alone.gesture")));

  const auto& all = signer->labels;
  REQUIRE(clip::write_labels({all.begin() + 1, all.begin() + 8}, studio.path("few.lab")));
  const std::vector<std::string> propose{"train",
                                         "gesture",
                                         "--clip",
                                         studio.path("take.csv"),
                                         "--labels",
                                         studio.path("few.lab"),
                                         "--auto-label",
                                         "--out",
                                         studio.path("all.lab")};
  const auto proposed = run(ranks_of(3, propose));
  INFO(proposed.err);
  CHECK(proposed.code == 0);
  CHECK(clip::read_labels(studio.path("all.lab")).has_value());
}

TEST_CASE("ranks that read different files say which one and write nothing", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  const MpiStudio studio;
  const TempFolder other;
  for (const char* name : {"march_1.bvh", "march_2.bvh", "sway_1.bvh", "sway_2.bvh"}) {
    std::filesystem::copy_file(studio.path(name), other.path() / name);
  }
  const auto differ = [&] {
    std::vector<std::string> command{"mpirun", "--allow-run-as-root", "--oversubscribe"};
    for (const auto& folder : {studio.folder.path(), other.path()}) {
      for (const char* word : {"-n", "1", "-wdir"}) command.emplace_back(word);
      command.push_back(folder.string());
      for (const char* word : {"train", "style", "--from", "march_1.bvh", "march_2.bvh", "--to",
                               "sway_1.bvh", "sway_2.bvh", "--out", "x.style"}) {
        if (std::string(word) == "train") command.push_back(posed_mpi().string());
        command.emplace_back(word);
      }
      command.emplace_back(":");
    }
    command.pop_back();
    return run(std::move(command));
  };
  std::ofstream(other.path() / "sway_1.bvh", std::ios::app) << "\n";
  const auto changed = differ();
  CHECK(changed.code == 1);
  CHECK(has(changed.err, "another sway_1.bvh ... rank 0"));
  std::filesystem::remove(other.path() / "sway_1.bvh");
  const auto missing = differ();
  CHECK(missing.code == 1);
  CHECK(has(missing.err, "cannot read sway_1.bvh ... rank 0 reads"));
  std::filesystem::rename(studio.path("sway_1.bvh"), other.path() / "sway_1.bvh");
  const auto reversed = differ();
  CHECK(reversed.code == 1);
  CHECK(has(reversed.err, "reads sway_1.bvh ... rank 0 cannot"));
  // What nobody can read is posed's own error.
  std::filesystem::remove(other.path() / "sway_1.bvh");
  CHECK(has(differ().err, "posed: sway_1.bvh: cannot read"));
  CHECK(studio.nothing_written("x.style"));
}

TEST_CASE("wrong use of posed-mpi is one sentence, and the exit code is posed's", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  const MpiStudio studio;
  auto arguments = studio.train("march_1.bvh");
  const auto done = run(ranks_of(2, arguments));
  CHECK(done.code == 2);
  const auto first = done.err.find("posed: ");
  CHECK(first != std::string::npos);
  CHECK(done.err.find("posed: ", first + 1) == std::string::npos);
}

TEST_CASE("a rank that dies ends the run, which says so and writes nothing", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  LongTraining training;
  const auto ranks = ranks_below(training.mpirun.pid());
  REQUIRE(ranks.size() == 2);
  kill(ranks.back(), SIGKILL);
  const auto done = finished(training.mpirun);
  CHECK(done.code != 0);
  CHECK(has(done.err, "mpirun ... rank has died"));
  CHECK(training.studio.nothing_written("long.style"));
}

TEST_CASE("a rank that has no memory left says so", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  LongTraining training;
  const rlimit nothing_more{1, 1};
  REQUIRE(prlimit(follower_of(training.mpirun.pid()), RLIMIT_AS, &nothing_more, nullptr) == 0);
  const auto done = finished(training.mpirun);
  CHECK(done.code != 0);
  CHECK(has(done.err, "posed-mpi: rank 1 on "));
  CHECK(has(done.err, "has ended: std::bad_alloc"));
  CHECK(training.studio.nothing_written("long.style"));
}

TEST_CASE("a rank that dies when the model is there is not said to have prevented it", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  const MpiStudio studio;
  // Rank 0 waits where it tells its result, because nobody reads.
  const Pipe pipe;
  pipe.fill();
  const std::string full =
      "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(pipe.write_end());
  const auto arguments = studio.train("kept.style");
  std::vector<std::string> command{
      "mpirun", "--allow-run-as-root",         "--oversubscribe",   "-n", "1", "sh",
      "-c",     "exec \"$0\" \"$@\" >" + full, posed_mpi().string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.insert(command.end(), {":", "-n", "1", posed_mpi().string()});
  command.insert(command.end(), arguments.begin(), arguments.end());
  Process mpirun(Command{std::move(command)});
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!std::filesystem::exists(studio.path("kept.style")) &&
         std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(follower_of(mpirun.pid()), SIGKILL);
  const auto done = finished(mpirun);
  CHECK(done.code != 0);
  CHECK(has(done.err, "mpirun ... rank has died"));
  CHECK(has(done.err, "written before"));
  CHECK_FALSE(has(done.err, "no model was written"));
  CHECK(std::filesystem::file_size(studio.path("kept.style")) > 0);
}

TEST_CASE("Ctrl-C ends all ranks and writes nothing", "[mpi]") {
  if (!std::filesystem::exists(posed_mpi())) SKIP_WITHOUT_MPI();
  LongTraining training;
  const auto ranks = ranks_below(training.mpirun.pid());
  training.mpirun.send(SIGINT);
  CHECK(finished(training.mpirun).code != 0);
  // mpirun may end a moment before those that it ends.
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  for (const pid_t rank : ranks) {
    while (runs(rank) && std::chrono::steady_clock::now() < patience) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    CHECK_FALSE(runs(rank));
  }
  CHECK(training.studio.nothing_written("long.style"));
}

}  // namespace posed::test
