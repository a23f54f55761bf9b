// Tasks: independent pieces of long cold work, with the results in the tasks' order whatever runs
// them, so that a training gives the same bits on any number of threads or machines. The library
// has no thread of its own; a caller that has some passes a TaskRunner in.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed {

// What a task gives back: plain numbers, which can travel between processes.
using TaskResult = std::vector<double>;

// Computes the result of task `index`. It depends on nothing but the index and data that no task
// changes, and is called from any thread, in any order.
using Task = std::function<TaskResult(std::size_t index)>;

// Receives how many tasks are done; returning false stops the work. Called on the thread that
// called run().
using TaskProgress = std::function<bool(std::size_t done)>;

class TaskRunner {
 public:
  TaskRunner() = default;
  TaskRunner(const TaskRunner&) = delete;
  TaskRunner& operator=(const TaskRunner&) = delete;
  virtual ~TaskRunner() = default;

  // The results of tasks 0 .. count - 1, in this order; nothing where `progress` (may be empty)
  // asked to stop. A task's exception reaches the caller.
  [[nodiscard]] virtual std::optional<std::vector<TaskResult>> run(
      std::size_t count, const Task& task, const TaskProgress& progress) = 0;

  // Whether `progress` has asked to stop. A task that takes seconds looks at it from time to time
  // and may then return anything; any thread may ask.
  [[nodiscard]] virtual bool stopping() const { return false; }
};

// The error of a training whose progress asked to stop.
[[nodiscard]] inline std::unexpected<Error> training_stopped() {
  return fail("the training was stopped; nothing was written");
}

// One after another on the caller's thread, so a stop waits for the end of a task.
class SerialTasks final : public TaskRunner {
 public:
  [[nodiscard]] std::optional<std::vector<TaskResult>> run(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) override {
    std::vector<TaskResult> results;
    for (std::size_t i = 0; i < count; ++i) {
      results.push_back(task(i));
      if (progress && !progress(i + 1)) return std::nullopt;
    }
    return results;
  }
};

}  // namespace posed
