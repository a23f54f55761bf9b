// The receiver of the benchmarks, a subscriber in its own process that records how old each message
// is when it arrives, and the figures of these ages.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/tools/bench/child_process.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// A received message. Its topic says which kind it is: bare/... or pose/...
struct Arrival {
  std::int64_t arrival_ns = 0;  // stamped in the reader
  // Of a pose: age when it was decoded, time in the stages, age when it was handed to ZeroMQ.
  std::int64_t decoded_ns = 0, stages_ns = 0, sent_ns = 0;
  std::int64_t age_ns = 0;  // age when the subscriber received it
  bool bare = false;
};

struct ReceivedMessages {
  std::vector<Arrival> messages;
  std::uint64_t gaps = 0;  // missing sequence numbers, over all pose streams
};

class HopSubscriber {
 public:
  // Forks; ChildProcess::fork says when.
  static Result<std::unique_ptr<HopSubscriber>> fork(bool gives_way = false);

  // Makes the process connect to the endpoints; returns when they have been sent.
  void begin(const std::vector<std::string>& endpoints);
  // Ends the process and returns what it recorded.
  Result<ReceivedMessages> finish();

 private:
  explicit HopSubscriber(ChildProcess process) : process_(std::move(process)) {}
  ChildProcess process_;
};

// The ages of messages at their receipt.
struct HopFigures {
  double p50_us = 0.0, p99_us = 0.0, p999_us = 0.0, max_us = 0.0;
  std::uint64_t messages = 0;
};

struct HopReport {
  HopFigures bare, pipeline;
  // Medians over pairs of adjacent one-second blocks, pipeline over bare.
  double block_p50_ratio = 0.0;
  double block_p99_ratio = 0.0;
};

[[nodiscard]] HopFigures figures_of(std::vector<double> ages_us);

// Block 0 begins at `start_ns`; the pipeline has the even blocks. The first pair (warm-up) and
// everything after `end_ns` are left out.
[[nodiscard]] HopReport report_hops(std::span<const Arrival> arrivals, std::int64_t start_ns,
                                    std::int64_t end_ns);

}  // namespace posed::tools
