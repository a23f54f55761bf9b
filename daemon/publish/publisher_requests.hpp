// What other threads ask of the publisher's thread, and results for them. Cold: never used by the
// hot threads.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/publish/publisher.hpp"

namespace posed::publish {

struct Publisher::Requests {
  struct Posted {
    std::uint32_t stream;
    v1::Event::Kind kind;
    std::string text;
  };
  // What the publisher does at its next turn; streams come by PublishedSlots::add().
  struct Batch {
    std::vector<Posted> events;
    std::vector<std::uint32_t> leaving;
    bool check = false;
  };

  mutable std::mutex mutex;  // guards everything but `asked`
  Batch batch;
  std::atomic<bool> asked{false};  // `batch` or the slots' additions have something new
  bool served = false;             // a thread is in run()
  // Removals, counted since the start: a caller waits until its own is done.
  std::uint64_t removals = 0, removals_done = 0;
  std::condition_variable done;
  v1::Stats stats;  // the last ones, without the streams
};

}  // namespace posed::publish
