// SourceBuilder makes streams of what devices with several bodies say about themselves. What a
// description changes happens between two packets; streams that it does not concern go on without a
// gap. Cold: it has a thread of its own (assembly::BodyStreams).
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

  // Sources, models, partners and host outlive the builder, and the reader ends before it.
  // `reserved` are the names of all other streams, `partners` those that stages may name.
  SourceBuilder(std::vector<std::unique_ptr<BodySource>>& sources, StreamSlots slots,
                std::set<std::string> reserved, ModelFiles& models,
                const pipeline::PartnerStreams& partners, StreamHost& host);

  // Does what is due. Returns when to call it next at the latest; call earlier if the EventFd of
  // the sources' BodyExchange is notified.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);
  // Any thread: no more streams are wanted. A turn under way ends before the next body, because
  // many bodies with large models take seconds.
  void stop() noexcept { shared_.stopped.store(true, std::memory_order_release); }
  [[nodiscard]] bool stopped() const noexcept { return shared_.is_stopped(); }

 private:
  SharedBodies shared_;
  std::vector<std::unique_ptr<SourceBodies>> sources_;
};

}  // namespace posed::devices
