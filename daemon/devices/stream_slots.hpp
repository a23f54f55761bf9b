// The slots of the streams. Cold.
#pragma once

#include <cassert>
#include <cstdint>
#include <deque>
#include <optional>

#include "daemon/pipeline/messages.hpp"

namespace posed::devices {

class StreamSlots {
 public:
  // `reserved` of them are only for streams that the config names.
  StreamSlots(std::uint32_t count, std::size_t reserved) : reserved_(reserved) {
    for (std::uint32_t slot = 0; slot < count; ++slot) free_.push_back({slot, 0});
  }

  // A free slot with its next generation, as a stream id: that of the slot that is free for the
  // longest time. Empty if none is free.
  [[nodiscard]] std::optional<std::uint32_t> next_free(bool named) {
    if (free_.size() <= (named ? 0 : reserved_)) return std::nullopt;
    const Slot slot = free_.front();
    free_.pop_front();
    assert(!named || reserved_ > 0);  // each named stream has one at a time
    if (named) --reserved_;
    return pipeline::stream_id(slot.number, slot.generation);
  }

  // The next stream in the same slot. After 65,534 of them the ids come again, except the first:
  // those that had them ended long ago.
  [[nodiscard]] static std::uint32_t next(std::uint32_t stream) {
    const std::uint32_t generation = pipeline::generation_of(stream);
    return pipeline::stream_id(pipeline::slot_of(stream),
                               generation < pipeline::kMaxGeneration ? generation + 1 : 1);
  }

  // The slot's last stream has left; `named` as in next_free().
  void give_back(std::uint32_t stream, bool named) {
    if (named) ++reserved_;
    ++freed_;
    const std::uint32_t id = next(stream);
    free_.push_back({pipeline::slot_of(id), pipeline::generation_of(id)});
  }

  // How often a slot was given back.
  [[nodiscard]] std::uint64_t freed() const { return freed_; }

 private:
  struct Slot {
    std::uint32_t number;
    std::uint32_t generation;
  };
  std::deque<Slot> free_;
  std::size_t reserved_;
  std::uint64_t freed_ = 0;
};

}  // namespace posed::devices
