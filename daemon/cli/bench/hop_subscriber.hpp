// The receiver of `posed bench pipeline`: a subscriber in its own process that records how old each
// message is when it arrives.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::cli {

// A received message. Its topic says which kind it is: bare/... or pose/...
struct Arrival {
  std::int64_t arrival_ns = 0;  // stamped in the reader
  std::int64_t age_ns = 0;      // age when the subscriber received it
  bool bare = false;
};

struct ReceivedMessages {
  std::vector<Arrival> messages;
  std::uint64_t gaps = 0;  // missing sequence numbers, over all pose streams
};

class HopSubscriber {
 public:
  // Forks; call before the process has a second thread or a ZeroMQ context.
  [[nodiscard]] static Result<std::unique_ptr<HopSubscriber>> fork();
  ~HopSubscriber();
  HopSubscriber(const HopSubscriber&) = delete;
  HopSubscriber& operator=(const HopSubscriber&) = delete;

  // Makes the process connect to both endpoints; returns when the endpoints have been sent.
  void begin(const std::string& pipeline_endpoint, const std::string& bare_endpoint);
  // Ends the process and returns what it recorded.
  [[nodiscard]] Result<ReceivedMessages> finish();

 private:
  HopSubscriber(int process, int to, int from) : process_(process), to_(to), from_(from) {}
  int process_;
  int to_;    // pipe to the child: two lines; closing it ends the child
  int from_;  // pipe from the child: gaps, then ReceivedMessages
};

}  // namespace posed::cli
