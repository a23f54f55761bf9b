// Broadcast: publishes what a replay makes as the live run did: same topics, same messages. Cold.
#pragma once

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/control/gatekeeper.hpp"
#include "daemon/control/zmq_handle.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/wake.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/record/replay.hpp"
#include "proto/frame/result.hpp"

namespace posed::record {

class Broadcast {
 public:
  // Binds and starts the publisher's thread. A log holds no keys, so only loopback is allowed.
  [[nodiscard]] static Result<std::unique_ptr<Broadcast>> open(const std::string& endpoint,
                                                               const Replay& replay);
  ~Broadcast();  // publishes what is waiting, then ends
  Broadcast(const Broadcast&) = delete;
  Broadcast& operator=(const Broadcast&) = delete;

  [[nodiscard]] const std::string& endpoint() const noexcept { return publisher_->endpoint(); }
  // Waits while the publisher is behind: a replay loses nothing.
  void add(const pipeline::Item& item);

 private:
  Broadcast(std::size_t streams, std::size_t slots, std::unique_ptr<pipeline::Wake> wake);

  control::Context context_;
  std::unique_ptr<control::Gatekeeper> gatekeeper_;
  std::vector<pipeline::StreamCounters> counters_;
  pipeline::Ring<pipeline::Item> ring_;
  std::unique_ptr<pipeline::Wake> wake_;
  std::unique_ptr<publish::Publisher> publisher_;
  std::jthread thread_;
};

}  // namespace posed::record
