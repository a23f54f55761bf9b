// Reader: the one thread that reads all devices, decodes what they sent and hands the frames to the
// pipeline thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/wake.hpp"
#include "daemon/record/tape.hpp"
#include "drivers/driver.hpp"

namespace posed::pipeline {

// What the reader needs of its surroundings; all of it outlives the reader.
struct ReaderPorts {
  Ring<Item>* out = nullptr;
  Wake* pipeline = nullptr;      // rung when there is something in `out`
  record::Tape* tape = nullptr;  // null: nothing is recorded
  Clock clock = nullptr;
};

class Reader {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Reader>> open(const ReaderPorts& ports);
  ~Reader();

  // Streams are numbered in the order of adding. Cold, before run().
  [[nodiscard]] Result<> add(drivers::Device& device, StreamCounters& counters);

  // Runs until stop(). The calling thread becomes the reader thread.
  void run() noexcept;
  void stop() noexcept;  // any thread

 private:
  class Source;
  Reader(const ReaderPorts& ports, std::unique_ptr<Wake> wake, std::unique_ptr<Poller> poller);
  // Reads what is due; returns when the next look at the clock is due.
  std::int64_t serve_timed(std::int64_t now_ns) noexcept;
  void serve(Source& source) noexcept;

  ReaderPorts ports_;
  std::unique_ptr<Wake> wake_;
  std::unique_ptr<Poller> poller_;
  std::vector<std::unique_ptr<Source>> sources_;
  std::atomic<bool> stop_{false};
};

}  // namespace posed::pipeline
