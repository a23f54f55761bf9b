// Schedule: when each decision of a log takes effect. Format 3 places all decisions in one order,
// each just before an item; the older formats place each just before a frame of its own stream.
// Cold.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "daemon/pipeline/messages.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

class Schedule {
 public:
  struct Entry {
    std::size_t stream = 0;  // by place in the log
    log::DecisionRow row;
  };

  Schedule(std::size_t streams, bool counts_items)
      : counts_items_(counts_items), queues_(counts_items ? 1 : streams) {}

  // In the order of the log.
  void add(Entry entry) {
    queues_[counts_items_ ? 0 : entry.stream].waiting.push_back(std::move(entry));
  }

  // The next decision that takes effect before `item`; null when none is left that does. Stays
  // valid.
  [[nodiscard]] const Entry* due(const pipeline::Item& item, std::size_t stream) {
    Queue& queue = queues_[counts_items_ ? 0 : stream];
    if (queue.next == queue.waiting.size()) return nullptr;
    const Entry& entry = queue.waiting[queue.next];
    if (counts_items_ ? entry.row.item > item.number : !before_frame(entry, item)) return nullptr;
    ++queue.next;
    return &entry;
  }

  // After the last item: what was decided when none came any more.
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
