// Ranks: the processes that train one model together. `posed` is alone; those of `posed-mpi` all
// run the same command, share its tasks and come to the same model, which one of them writes.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "daemon/tools/command/thread_tasks.hpp"
#include "models/tasks.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {

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
  [[nodiscard]] virtual Result<> check_same(const std::vector<std::filesystem::path>& inputs) = 0;

  // Lets the one that leads write the model. A signal that ends the process comes before that, or
  // when it is known that the model is there.
  template <typename Write>
  [[nodiscard]] Result<> write_model(const Write& write) {
    if (!leads()) return {};
    const HeldSignals held;
    auto written = write();
    if (written) model_is_there();
    return written;
  }

 protected:
  virtual void model_is_there() {}
};

// This process alone, on the machine's cores.
class OneRank final : public Ranks {
 public:
  [[nodiscard]] TaskRunner& tasks() override { return tasks_; }
  [[nodiscard]] bool leads() const override { return true; }
  [[nodiscard]] Result<> check_same(const std::vector<std::filesystem::path>& /*inputs*/) override {
    return {};
  }

 private:
  ThreadTasks tasks_;
};

}  // namespace posed::tools
