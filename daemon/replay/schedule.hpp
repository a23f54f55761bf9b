// Schedule: when each decision of a log takes effect. In format 3 all decisions have one order,
// each just before an item; in older formats each takes effect just before a frame of its own
// stream. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

class Schedule {
 public:
  struct Entry {
    std::size_t stream = 0;  // index of the stream in the log
    log::DecisionRow row;
  };

  Schedule(std::size_t streams, bool counts_items)
      : counts_items_(counts_items), queues_(counts_items ? 1 : streams) {}

  // Call in the order of the log.
  void add(Entry entry) {
    queues_[counts_items_ ? 0 : entry.stream].waiting.push_back(std::move(entry));
  }

  // The next decision that takes effect before `item`; null if none is left that does. The pointer
  // stays valid.
  [[nodiscard]] const Entry* due(const pipeline::Item& item, std::size_t stream) {
    if (counts_items_) return due(item.number);
    Queue& queue = queues_[stream];
    if (queue.next == queue.waiting.size() || !before_frame(queue.waiting[queue.next], item)) {
      return nullptr;
    }
    return &queue.waiting[queue.next++];
  }

  // The same for all streams, before the item with this number. Only for format 3.
  [[nodiscard]] const Entry* due(std::uint64_t item) {
    Queue& queue = queues_[0];
    if (queue.next == queue.waiting.size() || queue.waiting[queue.next].row.item > item) {
      return nullptr;
    }
    return &queue.waiting[queue.next++];
  }

  // Call after the last item: the decisions that were made when no more items came; null after the
  // last.
  [[nodiscard]] const Entry* rest() {
    for (Queue& queue : queues_) {
      if (queue.next < queue.waiting.size()) return &queue.waiting[queue.next++];
    }
    return nullptr;
  }

 private:
  struct Queue {
    std::vector<Entry> waiting;
    std::size_t next = 0;
  };

  static bool before_frame(const Entry& entry, const pipeline::Item& item) {
    return item.kind == pipeline::Item::Kind::kFrame &&
           entry.row.before_frame <= item.frame.header.sequence;
  }

  bool counts_items_;
  std::vector<Queue> queues_;
};

}  // namespace posed::replay
