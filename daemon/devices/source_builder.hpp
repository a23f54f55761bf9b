// SourceBuilder makes the streams of all sources: at the start those of devices with one body, and
// while the daemon runs what devices with several bodies say about themselves. What a description
// changes happens between two packets; streams that it does not concern go on without a gap. Cold:
// where a source has several bodies it has a thread of its own (assembly::Streams).
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
  // A device log has room for more streams (log::kMaxStreams).
  static constexpr std::size_t kMaxMade = 60'000;

  // Sources, models, settings and host outlive the builder, and the reader ends before it.
  // `reserved` are names that no body may get; `slots` is how many streams there may be at once;
  // `max_made` is how many are made without a pause in all, of which each source has its share.
  SourceBuilder(std::vector<std::unique_ptr<OpenSource>>& sources, std::uint32_t slots,
                std::set<std::string> reserved, ModelFiles& models, const KeptSettings& kept,
                StreamHost& host, std::size_t max_made = kMaxMade);

  // Builds the streams of devices with one body, those that others have as partners first. They
  // have the first slots, in the order of the sources. The error names the stream.
  Result<> open();
  // Makes these streams known to the host, in the order of the sources. Call once, before the
  // reader runs.
  void begin();

  // Does what is due. Returns when to call it next at the latest; call earlier if the EventFd of
  // the sources' BodyExchange is notified.
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
