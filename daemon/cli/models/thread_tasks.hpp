// ThreadTasks: runs a training's tasks on the machine's cores.
#pragma once

#include "models/tasks.hpp"

namespace posed::cli {

class ThreadTasks final : public TaskRunner {
 public:
  // 0 threads: one for each core.
  explicit ThreadTasks(unsigned threads = 0);

  // `progress` is also called while no task ends, so that Ctrl-C is seen soon; after a stop the
  // tasks that run are awaited and no other begins.
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override;

 private:
  unsigned threads_;
};

}  // namespace posed::cli
