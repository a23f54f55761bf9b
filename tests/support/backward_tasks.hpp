// Runs the tasks from the last to the first: what does not depend on their order gives the same.
#pragma once

#include "models/tasks.hpp"

namespace posed::test {

class BackwardTasks final : public TaskRunner {
 public:
  std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                             const TaskProgress& /*progress*/) override {
    std::vector<TaskResult> results(count);
    for (std::size_t i = count; i-- > 0;) results[i] = task(i);
    return results;
  }
};

}  // namespace posed::test
