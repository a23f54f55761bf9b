// SourceBuilder makes the streams of all sources: at the start those of devices with one body, and
// while the daemon runs those that devices with several bodies describe. A description takes effect
// between two packets; streams that it does not concern go on without a gap. Cold: if a source has
// several bodies the builder has a thread of its own (assembly::Streams).
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/devices/source_bodies.hpp"

namespace posed::devices {

class SourceBuilder {
 public:
  // At most this often the bodies of a source change.
  static constexpr std::int64_t kBetweenUpdates_ns = 500'000'000;
  // After a source has used its share of `max_made`, its bodies change at most this often.
  static constexpr std::int64_t kBetweenLateUpdates_ns = 10 * kNanosPerSecond;
  // Less than a device log has room for (log::kMaxStreams).
  static constexpr std::size_t kMaxMade = 60'000;

  // Sources, models, settings and host outlive the builder, and the reader ends before it.
  // `reserved` are names that no body may get; `slots` is how many streams there may be at once;
  // `max_made` is how many are made without a pause in all, of which each source has its share.
  SourceBuilder(std::vector<std::unique_ptr<OpenSource>>& sources, std::uint32_t slots,
                std::set<std::string> reserved, ModelFiles& models, const KeptSettings& kept,
                StreamHost& host, std::size_t max_made = kMaxMade);

  // Builds the streams of devices with one body, partners of others before these. They have the
  // first slots, in the order of the sources. The error names the stream.
  Result<> open();
  // Makes these streams known to the host, in the order of the sources. Call once, before the
  // reader runs.
  void begin();

  // Takes back streams that have ended and builds those that are due. Returns the latest time of
  // the next call; call earlier if the EventFd of the sources' BodyExchange is notified.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);
  // Any thread: no more streams are wanted. A turn under way ends before the next body, because
  // many bodies with large models need seconds.
  void stop() noexcept { shared_.stopped.store(true, std::memory_order_release); }
  [[nodiscard]] bool stopped() const noexcept { return shared_.is_stopped(); }

 private:
  SharedBodies shared_;
  std::vector<std::unique_ptr<SourceBodies>> sources_;
  std::vector<SourceBodies*> only_;  // those with one body
  std::vector<const config::StreamConfig*> only_configs_;
};

}  // namespace posed::devices
