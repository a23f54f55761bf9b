// The ranks of `posed-mpi` and the messages between them. Cold.
#pragma once

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/command/ranks.hpp"
#include "models/tasks.hpp"

namespace posed::mpi {

// Link: the messages between the ranks of one `mpirun`. Each is a kind and bytes, those of one
// sender come in its order, and waiting costs no CPU. One thread uses it.
enum class Kind : std::uint8_t {
  kInputs,    // leader: what it was started with and reads
  kCompared,  // answer: what differs here; empty if nothing does
  kDone,      // how many tasks of this round are done here
  kResults,   // of this rank's tasks
  kAll,       // leader: the results of all tasks
  kStop,      // leader: no rank shall go on
  kLeft,      // the command has ended here; its last words
};

struct Message {
  int from = 0;
  Kind kind{};
  std::vector<std::byte> bytes;

  [[nodiscard]] std::string_view text() const {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
};

class Link {
 public:
  // Joins the other ranks; without mpirun this process is the only one.
  Link();
  // Waits for all ranks.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return static_cast<int>(hosts_.size()); }
  [[nodiscard]] std::string name(int rank) const;  // "rank 2 on hostb"
  [[nodiscard]] int ranks_here() const;            // on this rank's machine

  // Returns when the other rank receives, or earlier.
  void send(int to, Kind kind, std::span<const std::byte> bytes = {});
  void send(int to, Kind kind, std::string_view text) {
    send(to, kind, std::as_bytes(std::span(text)));
  }

  // The next message that has come, from anybody.
  [[nodiscard]] std::optional<Message> poll();
  // Waits for it.
  [[nodiscard]] Message next();

 private:
  int rank_ = 0;
  std::vector<std::string> hosts_;  // [rank]
};

// The numbers of a list of tasks as one message: of each result its length, then its numbers; all
// as doubles, so that their bits are kept.
[[nodiscard]] inline std::vector<double> packed(std::span<const TaskResult> results) {
  std::vector<double> numbers;
  for (const TaskResult& result : results) {
    numbers.push_back(static_cast<double>(result.size()));
    numbers.insert(numbers.end(), result.begin(), result.end());
  }
  return numbers;
}

[[nodiscard]] inline std::vector<TaskResult> unpacked(std::span<const std::byte> bytes) {
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  std::vector<TaskResult> results;
  for (auto at = numbers.cbegin(); at != numbers.cend();) {
    const auto length = static_cast<std::ptrdiff_t>(*at++);
    results.emplace_back(at, at + length);
    at += length;
  }
  return results;
}

// How many threads compute in each rank: its share of the machine's cores, but not more than mpirun
// has bound it to.
[[nodiscard]] unsigned threads_here(const Link& link);

// Whether the leader has written the model; for a signal handler.
extern volatile std::sig_atomic_t g_model_written;

// The ranks of `posed-mpi`. All run one command in step; rank 0 leads: it alone asks the caller
// whether to go on, prints and writes. Task i is computed by rank i modulo their number; the
// results go through the leader to all, so every rank goes on with the same bits.
class MpiRanks : public tools::Ranks, protected TaskRunner {
 public:
  // `command_line` must be the same in all ranks. The link outlives this.
  MpiRanks(Link& link, std::string command_line);

  [[nodiscard]] TaskRunner& tasks() final { return *this; }

  // Call when the command has ended here. Returns when it has ended in all ranks. `message`:
  // what this rank has printed, which the leader shows where it did not expect the end.
  virtual void leave(const std::string& message) = 0;

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
  Result<> check_same(const std::vector<std::filesystem::path>& inputs) override;
  void leave(const std::string& message) override;

 private:
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;
  void model_written() override { g_model_written = 1; }
  void send_all(Kind kind, std::span<const std::byte> bytes = {});
  void stop();
  // Takes what has come; false where a rank has left.
  [[nodiscard]] bool listen();
  [[nodiscard]] std::size_t answers(Kind kind) const;
  // What another rank found to differ.
  Result<> compared() const;

  std::vector<Message> came_;  // the answers of one round, but not kDone
  std::vector<std::size_t> done_ = std::vector<std::size_t>(link().size());
  int left_ = 0;      // ranks that have ended
  std::string loss_;  // the first of them, with its last words
  bool stopped_ = false;
};

class Follower final : public MpiRanks {
 public:
  using MpiRanks::MpiRanks;
  [[nodiscard]] bool leads() const override { return false; }
  Result<> check_same(const std::vector<std::filesystem::path>& inputs) override;
  void leave(const std::string& message) override;

 private:
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;
  // The leader's next message; nothing where it stops.
  [[nodiscard]] std::optional<Message> order();

  bool stopped_ = false;
};

}  // namespace posed::mpi
