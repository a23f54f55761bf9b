// Broadcast publishes a replay as the live run did: same topics, same messages. All times are those
// of the recording, and stats say that this is a replay. Bodies are published while they are there.
// Cold.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daemon/net/zap_authenticator.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/event_fd.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "proto/frame/result.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::replay {

// The current time in the recording that is being replayed. It steps back only where the
// recording's own times step back by more than a minute. Any thread.
class TakeClock {
 public:
  // `speed` is relative to the recording; 0: as fast as possible, and the clock stands still
  // between chunks.
  TakeClock(double speed, std::int64_t begin_ns, Clock host);

  void reached(std::int64_t arrival_ns);  // the replay has come to this arrival time
  [[nodiscard]] std::int64_t now_ns() const;

 private:
  [[nodiscard]] std::int64_t at(std::int64_t host_ns) const;

  double speed_;
  Clock host_;
  mutable std::mutex mutex_;
  std::int64_t take_ns_;  // the recording's time at ...
  std::int64_t host_ns_;  // ... this host time
};

struct BroadcastOptions {
  std::string endpoint;
  std::string log;            // the log's file name, to display
  double speed = 1.0;         // 0: as fast as possible
  std::int64_t begin_ns = 0;  // arrival of the log's first chunk
};

class Broadcast {
 public:
  // Binds and starts the publisher's thread. A log holds no keys, so only loopback is allowed. The
  // replay outlives the broadcast.
  static Result<std::unique_ptr<Broadcast>> open(const BroadcastOptions& options,
                                                 const Replay& replay);
  ~Broadcast();  // publishes what is waiting, then ends
  Broadcast(const Broadcast&) = delete;
  Broadcast& operator=(const Broadcast&) = delete;

  [[nodiscard]] const std::string& endpoint() const noexcept { return publisher_->endpoint(); }
  [[nodiscard]] TakeClock& clock() noexcept { return clock_; }
  // Waits while the publisher is behind, because a replay must not lose frames. Call on the
  // replay's thread.
  void add(const pipeline::Item& item);

 private:
  Broadcast(const BroadcastOptions& options, const Replay& replay, std::size_t slots,
            std::unique_ptr<system::EventFd> wake);
  // A stream of a body is added with its first item and removed after its last, the end.
  enum class Presence : std::uint8_t { kNotYet, kHere, kGone };

  [[nodiscard]] publish::StreamInfo info_of(std::uint32_t stream);
  void come(std::uint32_t stream);
  void leave(std::uint32_t stream);
  void publish_values(std::uint32_t stream);
  void note(const pipeline::StreamEvent& event);
  void note_change(const pipeline::StreamEvent& event);

  const Replay& replay_;
  TakeClock clock_;
  net::Context context_;
  std::unique_ptr<net::ZapAuthenticator> authenticator_;
  std::vector<pipeline::StreamCounters> counters_;
  pipeline::SourceCounters source_counters_;  // of all sources: a replay has no devices to count
  std::vector<Presence> presence_;
  std::vector<pipeline::StreamSettings>
      settings_;  // of all streams, with the names of the models in use
  pipeline::Ring<pipeline::Item> ring_;
  std::unique_ptr<system::EventFd> wake_;
  std::unique_ptr<publish::Publisher> publisher_;
  std::jthread thread_;
};

}  // namespace posed::replay
