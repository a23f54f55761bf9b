#include "daemon/tools/command/ranks.hpp"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace posed::tools {
namespace {

constexpr std::chrono::milliseconds kLook{
    100};  // how often progress is reported while no task ends

// What the workers share. Everything but the results themselves is guarded by the mutex.
struct Work {
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t next = 0, done = 0;
  bool stop = false;
  std::exception_ptr failure;
  std::vector<TaskResult> results;

  // Gives the next task's index to a worker; the number of tasks where there is none left.
  std::size_t claim() {
    const std::scoped_lock lock(mutex);
    return stop ? results.size() : std::min(next++, results.size());
  }
  void finish(std::exception_ptr thrown) {
    const std::scoped_lock lock(mutex);
    assert(done < results.size());
    ++done;
    if (thrown) {
      stop = true;
      failure = std::move(thrown);
    }
    changed.notify_one();
  }
};

void run_tasks(Work& work, const Task& task) {
  for (std::size_t i = work.claim(); i < work.results.size(); i = work.claim()) {
    std::exception_ptr thrown;
    try {
      work.results[i] = task(i);
    } catch (...) {
      thrown = std::current_exception();
    }
    work.finish(std::move(thrown));
  }
}

// Reports progress until all tasks are done, one failed or the caller asked to stop.
void watch(Work& work, const TaskProgress& progress, std::atomic<bool>& stopping) {
  std::unique_lock lock(work.mutex);
  while (work.done < work.results.size() && !work.stop) {
    work.changed.wait_for(lock, kLook);
    const std::size_t done = work.done;
    lock.unlock();
    const bool go_on = !progress || progress(done);
    stopping = !go_on;
    lock.lock();
    work.stop = work.stop || !go_on;
  }
}

}  // namespace

ThreadTasks::ThreadTasks(unsigned threads)
    : threads_(threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency())) {}

std::optional<std::vector<TaskResult>> ThreadTasks::run(std::size_t count, const Task& task,
                                                        const TaskProgress& progress) {
  stopping_ = false;
  Work work;
  work.results.resize(count);
  {
    std::vector<std::jthread> workers;
    const auto threads = std::min<std::size_t>(threads_, count);
    workers.reserve(threads);
    for (std::size_t t = 0; t < threads; ++t) {
      workers.emplace_back([&work, &task] { run_tasks(work, task); });
    }
    watch(work, progress, stopping_);
  }
  if (work.failure) std::rethrow_exception(work.failure);
  if (work.stop) return std::nullopt;
  return std::move(work.results);
}

}  // namespace posed::tools
