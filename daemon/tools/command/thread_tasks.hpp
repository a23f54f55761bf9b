// ThreadTasks: runs a training's tasks on the machine's cores.
#pragma once

#include <atomic>

#include "models/tasks.hpp"

namespace posed::tools {

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

}  // namespace posed::tools
