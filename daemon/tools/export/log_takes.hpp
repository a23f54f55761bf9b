// The takes of a device log: which one a person means, and when each was. Cold.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/rows.hpp"

namespace posed::replay {

struct LoggedTake {
  log::TakeRow row{};
  // Arrival of its first and its last chunk, after that of the log's first; empty: it has none.
  std::optional<double> begin_s{};
  std::optional<double> end_s{};
  bool has_gaps = false;  // the log lacks chunks that came during the take
};

// Reads through all chunks of the log.
[[nodiscard]] Result<std::vector<LoggedTake>> logged_takes(log::Reader& reader);

// `wanted` is a take's number, or its name if no other take has it. Otherwise the error lists the
// takes that there are.
[[nodiscard]] Result<log::TakeRow> find_take(const log::Reader& reader, const std::string& wanted);

[[nodiscard]] constexpr bool holds(const log::TakeRow& take, std::uint64_t item) noexcept {
  return item >= take.first_item && item <= take.last_item;
}

}  // namespace posed::replay
