// Who computes a training: the threads of this process, and the processes of `posed-mpi`. Cold.
#pragma once

#include <atomic>
#include <filesystem>
#include <vector>

#include "models/tasks.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {

// ThreadTasks: runs a training's tasks on the machine's cores.
class ThreadTasks final : public TaskRunner {
 public:
  // 0 threads: one for each core.
  explicit ThreadTasks(unsigned threads = 0);

  // `progress` is also called while no task ends, so that it can ask for a stop at any time. After
  // a stop no other task begins; run() returns when those that run have ended, which long ones do
  // when they see stopping().
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;
  [[nodiscard]] bool stopping() const override { return stopping_; }

 private:
  unsigned threads_;
  std::atomic<bool> stopping_ = false;
};

// Ranks: the processes that train one model together. `posed` is alone; those of `posed-mpi` all
// run the same command, share its tasks and come to the same model, which one of them writes.
class Ranks {
 public:
  Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  virtual ~Ranks() = default;

  // Gives every rank the results of all. Every rank runs the same tasks in the same order.
  [[nodiscard]] virtual TaskRunner& tasks() = 0;

  // Whether this one writes files; exactly one does.
  [[nodiscard]] virtual bool leads() const = 0;

  // Call before the work, with every file that it reads: an error in all ranks where one of them
  // reads other bytes than the first.
  virtual Result<> check_same(const std::vector<std::filesystem::path>& inputs) = 0;

  // Lets the one that leads write the model. A signal that ends the process comes before that, or
  // when it is known that the model is there.
  template <typename Write>
  Result<> write_model(const Write& write) {
    if (!leads()) return {};
    const HeldSignals held;
    auto written = write();
    if (written) model_written();
    return written;
  }

 protected:
  virtual void model_written() {}
};

// This process alone, on the machine's cores.
class OneRank final : public Ranks {
 public:
  [[nodiscard]] TaskRunner& tasks() override { return tasks_; }
  [[nodiscard]] bool leads() const override { return true; }
  Result<> check_same(const std::vector<std::filesystem::path>& /*inputs*/) override { return {}; }

 private:
  ThreadTasks tasks_;
};

}  // namespace posed::tools
