// The other end of `posed bench pipeline`: a subscriber in a process of its own that notes how old
// each message is when it comes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::cli {

// A message that came. Its kind is known by its topic: bare/... or pose/...
struct Arrival {
  std::int64_t arrival_ns = 0;  // stamped in the reader
  std::int64_t age_ns = 0;      // when the subscriber had it
  bool bare = false;
};

struct Arrivals {
  std::vector<Arrival> messages;
  std::uint64_t gaps = 0;  // sequence numbers that did not come, over all pose streams
};

class HopSubscriber {
 public:
  // Forks; call before the process has a second thread or a ZeroMQ context.
  [[nodiscard]] static Result<std::unique_ptr<HopSubscriber>> fork();
  ~HopSubscriber();
  HopSubscriber(const HopSubscriber&) = delete;
  HopSubscriber& operator=(const HopSubscriber&) = delete;

  // Connects to both endpoints; returns when the process has been told.
  void begin(const std::string& pipeline_endpoint, const std::string& bare_endpoint);
  // Tells it to end and takes what it noted.
  [[nodiscard]] Result<Arrivals> finish();

 private:
  HopSubscriber(int process, int to, int from) : process_(process), to_(to), from_(from) {}
  int process_;
  int to_;    // pipe: two lines, then its end is the end
  int from_;  // pipe: gaps, then Arrivals
};

}  // namespace posed::cli
