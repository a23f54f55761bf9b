// The ranks of `posed-mpi`. All run one command in step; rank 0 leads: it alone asks the caller
// whether to go on, prints and writes. Task i is computed by rank i modulo their number; the
// results go through the leader to all, so every rank goes on with the same bits. Cold.
#pragma once

#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "daemon/tools/command/ranks.hpp"
#include "daemon/tools/command/thread_tasks.hpp"
#include "daemon/tools/mpi/link.hpp"

namespace posed::mpi {

// How many threads compute in each rank: its share of the machine's cores, but not more than mpirun
// has bound it to.
[[nodiscard]] unsigned threads_here(const Link& link);

// Whether the leader has written the model; for a signal handler.
extern volatile std::sig_atomic_t g_model_is_there;

class MpiRanks : public tools::Ranks, protected TaskRunner {
 public:
  // `command_line` must be the same in all ranks. The link outlives this.
  MpiRanks(Link& link, std::string command_line);

  [[nodiscard]] TaskRunner& tasks() final { return *this; }

  // Call when the command has ended here. Returns when it has ended in all ranks. `last_words`:
  // what this rank has printed, which the leader shows where it did not expect the end.
  virtual void leave(const std::string& last_words) = 0;

 protected:
  struct Fact {
    std::string what, value;  // "take1.bvh" and its SHA-256, empty if it cannot be read
  };
  [[nodiscard]] std::vector<Fact> facts_of(const std::vector<std::filesystem::path>& inputs) const;

  // The results of this rank's share of the tasks.
  [[nodiscard]] std::optional<std::vector<TaskResult>> run_share(std::size_t count,
                                                                 const Task& task,
                                                                 const TaskProgress& progress);
  [[nodiscard]] bool stopping() const final { return threads_.stopping(); }
  [[nodiscard]] Link& link() { return link_; }
  [[nodiscard]] const Link& link() const { return link_; }

 private:
  Link& link_;
  std::string command_line_;
  tools::ThreadTasks threads_;
};

class Leader final : public MpiRanks {
 public:
  using MpiRanks::MpiRanks;
  [[nodiscard]] bool leads() const override { return true; }
  [[nodiscard]] Result<> check_same(const std::vector<std::filesystem::path>& inputs) override;
  void leave(const std::string& last_words) override;

 private:
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;
  void model_is_there() override { g_model_is_there = 1; }
  void send_all(Kind kind, std::span<const std::byte> bytes = {});
  void stop();
  // Takes what has come; false where a rank has left.
  [[nodiscard]] bool listen();
  [[nodiscard]] std::size_t answers(Kind kind) const;
  // What another rank found to differ.
  [[nodiscard]] Result<> compared() const;

  std::vector<Message> came_;  // the answers of one round, but not kDone
  std::vector<std::size_t> done_ =
      std::vector<std::size_t>(static_cast<std::size_t>(link().size()));
  int left_ = 0;      // ranks that have ended
  std::string loss_;  // the first of them, with its last words
  bool stopped_ = false;
};

class Follower final : public MpiRanks {
 public:
  using MpiRanks::MpiRanks;
  [[nodiscard]] bool leads() const override { return false; }
  [[nodiscard]] Result<> check_same(const std::vector<std::filesystem::path>& inputs) override;
  void leave(const std::string& last_words) override;

 private:
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;
  // The leader's next message; nothing where it stops.
  [[nodiscard]] std::optional<Message> order();

  bool stopped_ = false;
};

}  // namespace posed::mpi
