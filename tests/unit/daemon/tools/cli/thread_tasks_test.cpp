// Tasks on threads: results in order, stops and exceptions.
#include "daemon/tools/command/ranks.hpp"

#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

using namespace posed;
using namespace posed::tools;

TEST_CASE("results come in the tasks' order, whatever the number of threads", "[tasks]") {
  for (const unsigned threads : {0U, 1U, 3U, 64U}) {
    ThreadTasks tasks(threads);
    std::size_t reported = 0;
    const auto found = tasks.run(
        100, [](std::size_t i) { return TaskResult{static_cast<double>(i * i)}; },
        [&](std::size_t done) {
          CHECK(done >= reported);
          reported = done;
          return true;
        });
    REQUIRE(found);
    REQUIRE(found->size() == 100);
    for (std::size_t i = 0; i < 100; ++i) CHECK((*found)[i].front() == static_cast<double>(i * i));
  }
  CHECK(ThreadTasks(2).run(0, [](std::size_t) { return TaskResult{}; }, {})->empty());
}

TEST_CASE("after a stop no other task begins and nothing is given back", "[tasks]") {
  constexpr int kCount = 20'000;
  std::atomic<int> begun = 0;
  const auto found = ThreadTasks(2).run(
      kCount,
      [&](std::size_t) {
        ++begun;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return TaskResult{};
      },
      [](std::size_t) { return false; });
  CHECK_FALSE(found);
  // The caller needs less than the seconds that a quarter of the tasks take to ask for the stop.
  CHECK(begun < kCount / 4);
}

TEST_CASE("a task that takes long sees that it shall stop", "[tasks]") {
  ThreadTasks tasks(2);
  const auto found = tasks.run(
      2,
      [&](std::size_t) {
        while (!tasks.stopping()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return TaskResult{};
      },
      [](std::size_t) { return false; });
  CHECK_FALSE(found);
  // The next work begins anew.
  CHECK(tasks.run(1, [&](std::size_t) { return TaskResult{tasks.stopping() ? 1.0 : 0.0}; }, {}) ==
        std::vector<TaskResult>{{0.0}});
}

TEST_CASE("a task's exception reaches the caller", "[tasks]") {
  ThreadTasks tasks(2);
  CHECK_THROWS_AS(static_cast<void>(tasks.run(5,
                                              [](std::size_t i) -> TaskResult {
                                                if (i == 3) throw std::runtime_error("broken");
                                                return {};
                                              },
                                              {})),
                  std::runtime_error);
}
