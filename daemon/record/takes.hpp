// Takes: the takes of a recording, numbered as they begin. What changes waits here until the
// recorder thread writes it. Any thread; cold.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/take.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

using log::kMaxTakes;

// A take has begun or ended.
struct TakeChange {
  log::TakeRow row{};  // as the log is to have it
  std::int64_t time_ns = 0;
  std::string text{};  // a sentence about it
};

// How the recorder gets on.
struct RecorderState {
  std::string trouble{};          // why the log cannot be written at present; empty: it can
  std::uint64_t lost_chunks = 0;  // that the log lacks
};

class Takes {
 public:
  // `next_item`: the first item behind the mark. Returns the take that began or ended. Fails when
  // none runs that could be ended, or when there are too many.
  Result<pipeline::Take> mark(const pipeline::TakeMark& mark, std::uint64_t next_item);
  [[nodiscard]] std::optional<pipeline::Take> running() const;
  // Told by the recorder thread; the takes carry it on.
  void set_state(RecorderState state);
  [[nodiscard]] RecorderState state() const;
  // What has changed since the last call, in order.
  [[nodiscard]] std::vector<TakeChange> next_changes();

 private:
  // The take that runs, as things are now.
  [[nodiscard]] pipeline::Take as_of_now() const;
  void end(const pipeline::TakeMark& mark, std::uint64_t next_item);
  void begin(const pipeline::TakeMark& mark, std::uint64_t next_item);

  mutable std::mutex mutex_;
  std::uint32_t last_number_ = 0;
  std::uint64_t first_item_ = 0;  // of the take that runs
  std::optional<pipeline::Take> running_;
  RecorderState state_;
  std::uint64_t lost_before_ = 0;  // chunks, when the take that runs began
  std::vector<TakeChange> changes_;
};

}  // namespace posed::record
