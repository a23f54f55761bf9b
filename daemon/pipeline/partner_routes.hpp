// PartnerRoutes: hands the frames that streams publish to the engines whose stages have these
// streams as partners (StageType::partners), at once and in the same thread; so the order of the
// reader's items alone decides what a stage knows, live and in replay. RT-safe, but for reserve().
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

#include "daemon/pipeline/stream_engine.hpp"

namespace posed::pipeline {

class PartnerRoutes {
 public:
  // How many engines there may be at once. Cold.
  void reserve(std::size_t engines) { receivers_.resize(engines); }

  // From now on the engine gets its partners' frames, if it has partners; `out` gets what it makes
  // of them. Both stay until remove().
  void add(StreamEngine& engine, EngineOut& out) noexcept {
    if (engine.feeds().empty()) return;
    assert(count_ < receivers_.size());
    receivers_[count_++] = {&engine, &out};
  }
  // Does nothing for an engine that is not there.
  void remove(const StreamEngine& engine) noexcept {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (receivers_[i].engine != &engine) receivers_[kept++] = receivers_[i];
    }
    count_ = kept;
  }

  // Call with each item that a stream publishes. Poses that are only repeated are left out.
  void published(const Item& item) const noexcept {
    if (item.kind != Item::Kind::kFrame || item.frame.quality == Quality::kStale) return;
    for (std::size_t i = 0; i < count_; ++i) {
      for (const PartnerFeed& feed : receivers_[i].engine->feeds()) {
        if (feed.stream != item.frame.header.stream) continue;
        receivers_[i].engine->on_partner(feed, item.frame, *receivers_[i].out);
      }
    }
  }

 private:
  struct Receiver {
    StreamEngine* engine = nullptr;
    EngineOut* out = nullptr;
  };

  std::vector<Receiver> receivers_;  // the first count_
  std::size_t count_ = 0;
};

}  // namespace posed::pipeline
