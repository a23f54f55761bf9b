// Schedule: when each decision of a log takes effect, just before an item. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "proto/log/rows.hpp"

namespace posed::replay {

class Schedule {
 public:
  struct Entry {
    std::size_t stream = 0;  // index of the stream in the log
    log::DecisionRow row;
  };

  // Call in the order of the log.
  void add(Entry entry) { waiting_.push_back(std::move(entry)); }

  // The next decision that takes effect before the item with this number; null if none is left that
  // does. The pointer stays valid.
  [[nodiscard]] const Entry* due(std::uint64_t item) {
    if (next_ == waiting_.size() || waiting_[next_].row.item > item) return nullptr;
    return &waiting_[next_++];
  }

  // Call after the last item: the decisions that were made when no more items came; null after the
  // last.
  [[nodiscard]] const Entry* rest() {
    return next_ < waiting_.size() ? &waiting_[next_++] : nullptr;
  }

 private:
  std::vector<Entry> waiting_;
  std::size_t next_ = 0;
};

}  // namespace posed::replay
