// PublishedSlots: the publisher's streams by the slots of their ids. A slot has one stream whose
// messages go out; later generations wait behind it. Only the publisher's thread changes what the
// slots hold, under the mutex, and it reads them without; other threads read under the mutex.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "daemon/publish/published_stream.hpp"

namespace posed::publish {

class PublishedSlots {
 public:
  explicit PublishedSlots(std::size_t slots) : slots_(slots) {}

  // Any thread, cold: the stream comes into its slot at place_additions().
  void add(std::unique_ptr<PublishedStream> stream);
  // Any thread, cold. Does nothing if there is no such stream.
  void set_stages(std::uint32_t stream, std::vector<StageInfo> stages);
  // Any thread, cold: adds the streams that have their slots, and what was published of those that
  // are gone. Both are of one moment, so that no frame counts twice or not at all.
  void fill(v1::Stats& stats) const;
  [[nodiscard]] std::vector<StreamFigures> figures() const;  // of these streams

  // All below: the publisher's thread, or another one while that does not run.

  // The stream if it has its slot; else null.
  RT_SAFE [[nodiscard]] PublishedStream* current(std::uint32_t stream) noexcept;
  // Whatever has the slot; null if nothing has.
  [[nodiscard]] PublishedStream* holder(std::uint32_t slot) noexcept;
  // The stream, also if it waits; else null.
  [[nodiscard]] PublishedStream* find(std::uint32_t stream) noexcept;
  void place_additions();
  // The next generation takes the slot; what has it now is gone.
  void advance(std::uint32_t slot);
  // Does nothing if there is no such stream.
  void remove(std::uint32_t stream);

  // What was published of the streams that are gone.
  void fill_left(v1::Stats& stats) const;

  template <typename Use>
  void for_each(Use&& use) {
    for (Slot& slot : slots_) {
      if (!slot.empty()) use(*slot.front());
    }
  }
  // Calls `use` once for each stream that has got its slot since the last call. `use` may not
  // change the slots.
  template <typename Use>
  void for_each_new(Use&& use) {
    if (!changed_) return;
    changed_ = false;
    for_each([&](PublishedStream& stream) {
      if (stream.announced) return;
      stream.announced = true;
      use(stream);
    });
  }

 private:
  using Slot = std::vector<std::unique_ptr<PublishedStream>>;  // the one that has it is the first

  void count_left(const PublishedStream& stream);  // under mutex_

  mutable std::mutex mutex_;
  std::vector<Slot> slots_;                                  // changed under mutex_
  std::vector<std::unique_ptr<PublishedStream>> additions_;  // under mutex_
  PublishedStream::Counts left_;                             // of the gone ones; under mutex_
  bool changed_ = false;  // a stream may have got its slot; publisher's thread
};

}  // namespace posed::publish
