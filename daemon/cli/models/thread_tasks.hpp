// ThreadTasks: runs a training's tasks on the machine's cores.
#pragma once

#include "models/tasks.hpp"

namespace posed::cli {

class ThreadTasks final : public TaskRunner {
 public:
  // 0 threads: one for each core.
  explicit ThreadTasks(unsigned threads = 0);

  // `progress` is also called while no task ends, so that it can ask for a stop at any time. After
  // a stop no other task begins, but run() returns only when those that run have ended: a task
  // cannot be interrupted, so a stop takes as long as the longest of them still needs.
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;

 private:
  unsigned threads_;
};

}  // namespace posed::cli
